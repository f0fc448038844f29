// One writer of virtual pin edges: its ring, its slot, and the order in which they are touched
// (pins_layout.h).
#pragma once

#include <bit>

#include "board/linux/clock.h"
#include "board/linux/cycle_clock.h"
#include "board/linux/pins_file.h"

namespace qduino::board::linux {

/// Used by one thread at a time. Writing never blocks and never allocates: about 20 ns.
class PinWriter {
  public:
    PinWriter() = default;  ///< not open

    /// Maps the ring of `writer` and takes it over from whoever had it. Setup-time.
    Result<void> open(const PinsFile& file, int writer, VcpuId vcpu) {
        auto mapped = file.map_ring(writer, true);
        if (!mapped) return mapped.error();
        ring_ = std::move(*mapped);
        wide_ = is_wide(writer);
        slot_ = &file.layout().writers[static_cast<std::size_t>(writer)];
        slot_->writing.store(0);
        wide_ ? ring_.as<WideRing>()->adopt_writer() : ring_.as<NarrowRing>()->adopt_writer();
        slot_->in_use.store(1u + vcpu, std::memory_order_release);  // before any clock reading of this writer
        return {};
    }
    [[nodiscard]] bool is_open() const { return slot_ != nullptr; }

    void write_level(PinId pin, Level level) { push({0, pin.number, PinEventKind::level, level, 0}); }
    void write_pwm(PinId pin, double duty) {
        push({0, pin.number, PinEventKind::pwm, Level::low,
              std::bit_cast<std::uint32_t>(static_cast<float>(duty))});
    }
    void write_pwm_period(PinId pin, Nanoseconds period) {
        push(
            {0, pin.number, PinEventKind::pwm_period, Level::low, static_cast<std::uint32_t>(to_ns(period))});
    }

  private:
    void push(PinEvent event) {
        slot_->writing.store(1, std::memory_order_relaxed);
        std::atomic_signal_fence(std::memory_order_seq_cst);  // then the clock: see kSettle in pins_layout.h
        event.time_ns = to_ns(cycle_clock.soon());
        const bool held =
            wide_ ? ring_.as<WideRing>()->try_push(event) : ring_.as<NarrowRing>()->try_push(event);
        if (!held) slot_->lost.fetch_add(1, std::memory_order_relaxed);
        slot_->writing.store(0, std::memory_order_release);
    }

    Mapping ring_;
    WriterSlot* slot_ = nullptr;
    bool wide_ = false;
};

}  // namespace qduino::board::linux
