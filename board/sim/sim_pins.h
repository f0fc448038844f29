// The simulated board as far as its pins and buses: levels, edges, safe states, and what is wired
// to them.
//
//   loop ── write ──► level ──► Peripherals ──► pin_edge() ──► watched? ──► work for its I/O VCPU
//        ◄─ read ─── an output's own level, or what the outside drives, or an injected fault
#pragma once

#include <array>
#include <cstdint>

#include "base/result.h"
#include "board/board.h"
#include "board/peripherals.h"
#include "board/sim/config.h"
#include "board/sim/event_loop.h"

namespace qduino::board::sim {

class SimPins : public Board, private PinEdgeSink {
  public:
    SimPins(const SimPins&) = delete;
    SimPins& operator=(const SimPins&) = delete;

    // ---- as board.h has them --------------------------------------------------------------------
    [[nodiscard]] Result<void> pin_mode(PinId pin, PinMode mode) override;
    void pin_write(PinId pin, Level level) override {
        loop_.charge(ApiCall::pin_write);
        if (pin.number >= kPinCount) return;
        PinState& state = pins_[pin.number];
        state.level = level;
        if (!state.output) return;
        loop_.hash().pin_written(loop_.now(), pin, level);
        peripherals_.pin_written(loop_.now(), pin, level);
        if (state.watched) [[unlikely]]
            pin_edge(loop_.now(), pin, level);
    }
    /// An output reads back what was written; an input what the outside drives.
    [[nodiscard]] Level pin_read(PinId pin) override;
    [[nodiscard]] Result<void> pwm_write(PinId pin, double duty) override;
    [[nodiscard]] Result<void> pwm_period(PinId pin, Nanoseconds period) override;
    [[nodiscard]] Result<double> analog_read(PinId pin) override;
    [[nodiscard]] Result<void> i2c_transfer(I2cBus bus, I2cAddress address, std::span<const std::uint8_t> out,
                                            std::span<std::uint8_t> in) override;
    [[nodiscard]] Result<void> spi_transfer(SpiBus bus, SpiSettings settings,
                                            std::span<std::uint8_t> data) override;
    void device_work(DeviceClass device, std::size_t bytes) override;
    [[nodiscard]] Result<void> safe_state(PinId pin, Level level) override;
    [[nodiscard]] Result<void> attach_edge(PinId pin, Edge edge, EdgeHandler handler, void* context,
                                           VcpuId io) override;
    void detach_edge(PinId pin) override;
    [[nodiscard]] Nanoseconds bus_time(DeviceClass device, std::size_t bytes,
                                       std::uint32_t clock_hz) const override;
    [[nodiscard]] EdgeCost edge_cost() const override {
        return {.each = config_.edge_top_half, .interval = config_.edge_interval};
    }

    /// Forces every pin that has a safe state to it, as the supervisor of a real machine would.
    void force_safe_states();

    // ---- for the event loop ---------------------------------------------------------------------
    /// When the physics, or a look at the inputs, is due.
    [[nodiscard]] Instant next_due(Instant now) const {
        const Instant physics = peripherals_.next_event(now);
        return std::min({physics, next_poll_, next_held_back_});
    }
    void process_due(Instant now);

  protected:
    /// `peripherals` and `loop` outlive it.
    SimPins(SimConfig config, Peripherals& peripherals, EventLoop& loop);
    ~SimPins() override = default;

    const SimConfig config_;

  private:
    struct PinState {
        Level level = Level::low;  // last written
        bool output = false;
        bool watched = false;  // an edge handler is attached
        bool pwm = false;
        bool has_safe_state = false;
        Level safe_level = Level::low;
    };
    struct EdgeWatch {
        Edge edge = Edge::both;
        EdgeHandler handler = nullptr;
        void* context = nullptr;
        VcpuId io = kNoVcpu;
        Level last = Level::low;
        Instant next_top_half = kEpoch;  // not sooner
        bool held_back = false;          // an edge, until then
    };

    void pin_edge(Instant now, PinId pin, Level level) override;
    [[nodiscard]] bool stuck(PinId pin, Level* level) const;
    void poll_watched_pins();
    void take_edge(EdgeWatch& watch);
    void take_held_back(Instant now);

    EventLoop& loop_;
    Peripherals& peripherals_;
    std::array<PinState, kPinCount> pins_{};
    std::array<EdgeWatch, kPinCount> watches_{};
    bool edges_are_reported_;
    Instant next_poll_ = kForever;
    Instant next_held_back_ = kForever;
};

}  // namespace qduino::board::sim
