// Ring buffer: one writer, one reader, lossless, wait-free, placeable in shared memory.
//
//              tail (reader)          head (writer)
//                v                      v
//   [ . . . . . | A | B | C | D | E | . . . . ]      head - tail = items held, at most N
//
// Head and tail count the items ever written and read. The slot of an item is its count modulo N (a
// power of two), so full and empty need no spare slot and no flag.
//
// A counter that both sides look at for every item travels between their caches for every item. So
// each side keeps a copy of the other's counter, and looks again only when the copy says full (or
// empty).
//
// Memory order: a slot is written before head is released, and read after head is acquired. It is
// freed by releasing tail, and used again after acquiring it. Nothing else orders anything.
//
// The object holds no pointer, and a zeroed object is an empty ring: so is a mapped file of zeroes.
// A writer that dies between writing slots and releasing head leaves the ring as it was before.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>

namespace qduino::channel {

inline constexpr std::size_t kCacheLine = 64;
/// Cores also fetch lines in aligned pairs, so the two sides write to different pairs.
inline constexpr std::size_t kLinePair = 2 * kCacheLine;

/// Asks for the line at `address` to be owned by this core. A store to a line that is owned does
/// not hold up the stores behind it.
inline void fetch_for_writing(const void* address) {
#if defined(__x86_64__)  // where the builtin asks for a line to be shared
    asm volatile("prefetchw %0" : : "m"(*static_cast<const char*>(address)));
#else
    __builtin_prefetch(address, 1);
#endif
}

template <typename T, std::size_t N>
class RingBuffer {
    static_assert(std::has_single_bit(N), "the capacity is a power of two");
    static_assert(std::is_trivially_copyable_v<T>, "items cross threads and processes by their bytes");
    static_assert(std::atomic<std::uint64_t>::is_always_lock_free);

  public:
    static constexpr std::size_t kCapacity = N;

    // ---- writer's side --------------------------------------------------------------------------

    /// False, and nothing changed, when full. Wait-free.
    [[nodiscard]] bool try_push(const T& item) {
        if (!try_stage(item)) return false;
        commit(1);
        return true;
    }

    /// The first half of try_push(): `item` is in its slot, but the reader does not see it until
    /// commit(1). A second call before that overwrites it. False when full.
    [[nodiscard]] bool try_stage(const T& item) {
        const std::uint64_t head = head_.load(std::memory_order_relaxed);
        if (head - cached_tail_ >= N) {
            cached_tail_ = tail_.load(std::memory_order_acquire);
            if (head - cached_tail_ >= N) return false;
        }
        slots_[head & (N - 1)] = item;
        // The next item lies on a line of its own, which the reader had last. Smaller items share a
        // line, and larger ones take long enough anyway.
        if constexpr (sizeof(T) > kCacheLine / 2 && sizeof(T) <= kCacheLine)
            fetch_for_writing(&slots_[(head + kFetchAhead) & (N - 1)]);
        return true;
    }

    /// Lets the reader see the first `count` staged items: 0 or 1.
    void commit(std::uint64_t count) {
        head_.store(head_.load(std::memory_order_relaxed) + count, std::memory_order_release);
    }

    /// Pushes as many of `items` as fit, in order, and returns how many. The reader sees them all
    /// at once.
    std::size_t push_some(std::span<const T> items) {
        const std::uint64_t head = head_.load(std::memory_order_relaxed);
        if (N - held(head, cached_tail_) < items.size()) cached_tail_ = tail_.load(std::memory_order_acquire);
        const std::size_t count = std::min(items.size(), N - held(head, cached_tail_));
        if (count == 0) return 0;
        const std::size_t at = static_cast<std::size_t>(head & (N - 1));
        const std::size_t before_wrap = std::min(count, N - at);
        std::memcpy(slots_.data() + at, items.data(), before_wrap * sizeof(T));
        if (before_wrap < count) {
            std::memcpy(slots_.data(), items.data() + before_wrap, (count - before_wrap) * sizeof(T));
        }
        head_.store(head + count, std::memory_order_release);
        return count;
    }

    /// Pushes all of `items` and returns true, or none and false. The reader never sees a part of
    /// them.
    [[nodiscard]] bool try_push_all(std::span<const T> items) {
        return free() >= items.size() && push_some(items) == items.size();
    }

    /// Slots free now; the reader may free more at any time.
    [[nodiscard]] std::size_t free() const {
        return N - held(head_.load(std::memory_order_relaxed), tail_.load(std::memory_order_acquire));
    }

    // ---- reader's side --------------------------------------------------------------------------

    /// The oldest item, or null when empty. Stays valid until pop().
    [[nodiscard]] const T* front() { return peek(0); }

    /// The item `ahead` places behind the oldest, or null when fewer are held.
    [[nodiscard]] const T* peek(std::size_t ahead) {
        const std::uint64_t tail = tail_.load(std::memory_order_relaxed);
        if (cached_head_ - tail <= ahead) cached_head_ = head_.load(std::memory_order_acquire);
        if (cached_head_ - tail <= ahead) return nullptr;
        return &slots_[(tail + ahead) & (N - 1)];
    }

    /// Drops the oldest item. Only after front() returned one.
    void pop() { tail_.store(tail_.load(std::memory_order_relaxed) + 1, std::memory_order_release); }

    /// False, and `item` unchanged, when empty.
    [[nodiscard]] bool try_pop(T& item) {
        const std::uint64_t tail = tail_.load(std::memory_order_relaxed);
        if (cached_head_ == tail) {
            cached_head_ = head_.load(std::memory_order_acquire);
            if (cached_head_ == tail) return false;
        }
        item = slots_[tail & (N - 1)];
        tail_.store(tail + 1, std::memory_order_release);
        return true;
    }

    /// Moves the oldest items out, at most `items.size()`, and returns how many.
    std::size_t pop_some(std::span<T> items) {
        const std::uint64_t tail = tail_.load(std::memory_order_relaxed);
        if (cached_head_ - tail < items.size()) cached_head_ = head_.load(std::memory_order_acquire);
        const std::size_t count = std::min(items.size(), held(cached_head_, tail));
        if (count == 0) return 0;
        const std::size_t at = static_cast<std::size_t>(tail & (N - 1));
        const std::size_t before_wrap = std::min(count, N - at);
        std::memcpy(items.data(), slots_.data() + at, before_wrap * sizeof(T));
        if (before_wrap < count) {
            std::memcpy(items.data() + before_wrap, slots_.data(), (count - before_wrap) * sizeof(T));
        }
        tail_.store(tail + count, std::memory_order_release);
        return count;
    }

    /// Drops everything held now.
    void discard_all() {
        // Otherwise the copy would lie behind the new tail.
        cached_head_ = head_.load(std::memory_order_acquire);
        tail_.store(cached_head_, std::memory_order_release);
    }

    // ---- either side ----------------------------------------------------------------------------

    /// Items held, at one instant in the recent past. Counters outside 0…N (a damaged shared page)
    /// read as N.
    [[nodiscard]] std::size_t size() const {
        const std::uint64_t tail = tail_.load(std::memory_order_acquire);
        return held(head_.load(std::memory_order_acquire), tail);
    }
    [[nodiscard]] bool empty() const { return size() == 0; }
    /// Items ever pushed, and ever popped.
    [[nodiscard]] std::uint64_t pushed() const { return head_.load(std::memory_order_acquire); }
    [[nodiscard]] std::uint64_t popped() const { return tail_.load(std::memory_order_acquire); }

    /// For a writer that takes over from one that died: forget the copies it kept.
    void adopt_writer() { cached_tail_ = tail_.load(std::memory_order_acquire); }
    /// The same for a reader.
    void adopt_reader() { cached_head_ = tail_.load(std::memory_order_relaxed); }

  private:
    /// At most N, whatever the counters of a damaged shared page say: no count reaches outside the
    /// slots.
    static std::size_t held(std::uint64_t head, std::uint64_t tail) {
        return static_cast<std::size_t>(std::min<std::uint64_t>(head - tail, N));
    }

    static constexpr std::uint64_t kFetchAhead = 4;

    // Each side's copy stands apart from its counter. The other side may just have looked at the
    // counter's line, and a store to the copy would then wait for that line, with every item behind
    // it.
    alignas(kLinePair) std::atomic<std::uint64_t> head_{0};
    alignas(kCacheLine) std::uint64_t cached_tail_ = 0;  // the writer's
    alignas(kLinePair) std::atomic<std::uint64_t> tail_{0};
    alignas(kCacheLine) std::uint64_t cached_head_ = 0;  // the reader's
    alignas(kLinePair) std::array<T, N> slots_{};
};

}  // namespace qduino::channel
