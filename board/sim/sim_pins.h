// The pins and buses of the simulated board: levels, edges, safe states, and what is wired to them.
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

class SimPins final : private PinEdgeSink {
  public:
    /// All outlive it.
    SimPins(const SimConfig& config, Peripherals& peripherals, EventLoop& loop);

    // ---- as board.h has them --------------------------------------------------------------------
    [[nodiscard]] Result<void> set_mode(PinId pin, PinMode mode);
    void write(PinId pin, Level level) {
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
    [[nodiscard]] Level read(PinId pin);
    [[nodiscard]] Result<void> write_pwm(PinId pin, double duty);
    [[nodiscard]] Result<void> set_pwm_period(PinId pin, Nanoseconds period);
    [[nodiscard]] Result<double> read_analog(PinId pin);
    [[nodiscard]] Result<void> transfer(I2cBus bus, I2cAddress address, std::span<const std::uint8_t> out,
                                        std::span<std::uint8_t> in);
    [[nodiscard]] Result<void> transfer(SpiBus bus, SpiSettings settings, std::span<std::uint8_t> data);
    [[nodiscard]] Result<void> set_safe_state(PinId pin, Level level);
    void force_safe_states();
    [[nodiscard]] Result<void> attach(PinId pin, Edge edge, EdgeHandler handler, void* context, VcpuId io);
    void detach(PinId pin);

    // ---- for the event loop ---------------------------------------------------------------------
    /// When the physics, or a look at the inputs, is due.
    [[nodiscard]] Instant next_due(Instant now) const {
        const Instant physics = peripherals_.next_event(now);
        return physics < next_poll_ ? physics : next_poll_;
    }
    void process_due(Instant now);

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
    };

    void pin_edge(Instant now, PinId pin, Level level) override;
    [[nodiscard]] bool stuck(PinId pin, Level* level) const;
    void poll_watched_pins();

    EventLoop& loop_;
    Peripherals& peripherals_;
    std::array<PinState, kPinCount> pins_{};
    const SimConfig& config_;
    std::array<EdgeWatch, kPinCount> watches_{};
    bool edges_are_reported_;
    Instant next_poll_ = kForever;
};

}  // namespace qduino::board::sim
