// One writer of virtual pin edges: its ring, its slot, and the order in which they are touched
// (pins_layout.h).
#pragma once

#include <array>
#include <bit>
#include <span>

#include "board/linux/kernel/clock.h"
#include "board/linux/kernel/cycle_clock.h"
#include "board/linux/pin/pins_file.h"
#include "posix/mapping.h"

namespace qduino::board::linux {

/// Used by one thread at a time. Writing never blocks and never allocates: about 20 ns.
class PinWriter {
  public:
    PinWriter() = default;  ///< not open

    /// Maps the ring of `writer` and takes it over from its last owner. Setup-time.
    Result<void> open(const PinsFile& file, int writer, VcpuId vcpu) {
        QDUINO_TRY_ASSIGN(ring_, file.map_ring(writer, true));
        wide_ = is_wide(writer);
        slot_ = &file.layout().writers[static_cast<std::size_t>(writer)];
        slot_->writing.store(0);
        wide_ ? ring_.as<WideRing>()->adopt_writer() : ring_.as<NarrowRing>()->adopt_writer();
        // This comes before any clock reading of this writer.
        slot_->in_use.store(1u + vcpu, std::memory_order_release);
        return {};
    }
    [[nodiscard]] bool is_open() const { return slot_ != nullptr; }

    /// Does everything that a write does except to let the edge be seen, so that the next write
    /// finds its code and its data in the caches.
    void rehearse() { push({}, kNoPin, 0); }

    void write_level(PinId pin, Level level) { write_levels({&pin, 1}, level); }
    /// All pins change at one instant.
    void write_levels(std::span<const PinId> pins, Level level) {
        push({.kind = PinEventKind::level, .level = level}, pins);
    }
    void write_pwm(PinId pin, double duty) {
        push({.kind = PinEventKind::pwm, .value = std::bit_cast<std::uint32_t>(static_cast<float>(duty))},
             {&pin, 1});
    }
    void write_pwm_period(PinId pin, Nanoseconds period) {
        push({.kind = PinEventKind::pwm_period, .value = static_cast<std::uint32_t>(to_ns(period))},
             {&pin, 1});
    }

  private:
    static constexpr std::array<PinId, 1> kNoPin{};

    /// An edge of each pin, all with one time. `count`: 1; 0 for a rehearsal. Never inlined: a
    /// rehearsal must go through these very instructions.
    [[gnu::noinline]] void push(PinEvent event, std::span<const PinId> pins, std::uint64_t count = 1) {
        slot_->writing.store(1, std::memory_order_relaxed);
        // Then the clock: see kSettle in pins_layout.h.
        std::atomic_signal_fence(std::memory_order_seq_cst);
        event.time_ns = to_ns(cycle_clock.soon());
        for (const PinId pin : pins) {
            event.pin = pin.number;
            const bool held = wide_ ? push_to(*ring_.as<WideRing>(), event, count)
                                    : push_to(*ring_.as<NarrowRing>(), event, count);
            if (!held) slot_->lost.fetch_add(count, std::memory_order_relaxed);
        }
        slot_->writing.store(0, std::memory_order_release);
    }
    template <typename Ring>
    static bool push_to(Ring& ring, const PinEvent& event, std::uint64_t count) {
        if (!ring.try_stage(event)) return false;
        ring.commit(count);
        return true;
    }

    posix::Mapping ring_;
    WriterSlot* slot_ = nullptr;
    bool wide_ = false;
};

}  // namespace qduino::board::linux
