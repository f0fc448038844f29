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
// sequentially consistent atomics; the slots themselves are plain memory. What the writer says, the
// pair and each pair's slot, is one byte: Simpson's writer says the slot first and then the pair,
// and saying both at once is one of the orders that his proof allows.
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
        const unsigned latest = latest_.load(std::memory_order_relaxed);  // the writer's own
        const unsigned pair = reading_.load() ? 0u : 1u;
        const unsigned slot = slot_of(pair, latest) ^ 1u;
        slots_[pair][slot] = value;
        latest_.store(static_cast<std::uint8_t>((latest & (2u << (pair ^ 1u))) | slot << (1 + pair) | pair));
    }

    /// Reader only. Wait-free: one copy of T.
    [[nodiscard]] T read() const {
        const unsigned pair = latest_.load() & 1u;
        // Said again, it would cost the writer a cache line, and tell it nothing.
        if (reading_.load(std::memory_order_relaxed) != pair) reading_.store(static_cast<std::uint8_t>(pair));
        return slots_[pair][slot_of(pair, latest_.load())];
    }

  private:
    /// The slot of `pair` that was written last. It is masked: a damaged shared page must not index
    /// outside.
    static unsigned slot_of(unsigned pair, unsigned latest) { return latest >> (1 + pair) & 1u; }

    /// Small values lie in the line of the byte that tells of them: the reader fetches both.
    static constexpr std::size_t kSlotsBegin =
        4 * sizeof(T) + alignof(T) <= kCacheLine ? alignof(T) : kCacheLine;

    alignas(kCacheLine) mutable std::atomic<std::uint8_t> reading_{0};  // the pair
    /// Bit 0: the pair written last; bits 1 and 2: in pair 0 and in pair 1, the slot written last.
    alignas(kLinePair) std::atomic<std::uint8_t> latest_{0};
    alignas(kSlotsBegin) std::array<std::array<T, 2>, 2> slots_{};
};

}  // namespace qduino::channel
