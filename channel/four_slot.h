// Four-slot: one writer, one reader, always the freshest whole value, and neither side ever waits
// for the other.
//
// H. R. Simpson, "Four-slot fully asynchronous communication mechanism", IEE Proceedings 137(1),
// 1990.
//
//   two pairs of two slots:      pair 0: [a][b]     pair 1: [c][d]
//   writer:  takes the pair that the reader is NOT in, and there the slot NOT written last; says so
//   reader:  goes to the pair written last, says so, and reads the slot written last in it
//
// The writer avoids the reader by pair, and the reader avoids the writer by slot: they never touch
// the same slot. The argument needs a single order of the control variables. They are therefore
// sequentially consistent atomics; the slots themselves are plain memory.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <type_traits>

#include "channel/ring_buffer.h"

namespace qduino::channel {

/// A zeroed object holds a zeroed T. Placeable in shared memory.
template <typename T>
class FourSlot {
    static_assert(std::is_trivially_copyable_v<T>, "values cross threads and processes by their bytes");
    static_assert(std::atomic<std::uint8_t>::is_always_lock_free);

  public:
    /// Writer only. Wait-free: one copy of T.
    void write(const T& value) {
        const unsigned pair = reading_.load() ? 0u : 1u;
        const unsigned slot = latest_slot_[pair].load() ? 0u : 1u;
        slots_[pair][slot] = value;
        latest_slot_[pair].store(static_cast<std::uint8_t>(slot));
        latest_pair_.store(static_cast<std::uint8_t>(pair));
    }

    /// Reader only. Wait-free: one copy of T.
    [[nodiscard]] T read() const {
        // Masked: a damaged shared page must not index outside.
        const unsigned pair = latest_pair_.load() & 1u;
        reading_.store(static_cast<std::uint8_t>(pair));
        const unsigned slot = latest_slot_[pair].load() & 1u;
        return slots_[pair][slot];
    }

  private:
    alignas(kCacheLine) std::atomic<std::uint8_t> latest_pair_{0};
    std::array<std::atomic<std::uint8_t>, 2> latest_slot_{};
    alignas(kCacheLine) mutable std::atomic<std::uint8_t> reading_{0};
    alignas(kCacheLine) std::array<std::array<T, 2>, 2> slots_{};
};

}  // namespace qduino::channel
