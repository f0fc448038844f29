// The contenders: our two channels and their rivals behind the same two small faces.
//
//   queues   push, pop, push_some, pop_some     RingBuffer            boost::lockfree::spsc_queue
//   slots    write, read                        FourSlot              a mutex, a seqlock
#pragma once

#include <array>
#include <atomic>
#include <boost/lockfree/spsc_queue.hpp>
#include <cstdint>
#include <cstring>
#include <mutex>
#include <span>

#include "channel/four_slot.h"
#include "channel/ring_buffer.h"

namespace qduino::bench {

inline constexpr std::size_t kQueueCapacity = 1024;

template <std::size_t Bytes>
struct Payload {
    std::array<std::uint64_t, Bytes / 8> words{};
};

// ---- queues -------------------------------------------------------------------------------------

template <typename T>
struct QduinoRing {
    static constexpr const char* kName = "qduino_ring";
    bool push(const T& item) { return ring.try_push(item); }
    bool pop(T& item) { return ring.try_pop(item); }
    std::size_t push_some(std::span<const T> items) { return ring.push_some(items); }
    std::size_t pop_some(std::span<T> items) { return ring.pop_some(items); }
    channel::RingBuffer<T, kQueueCapacity> ring;
};

template <typename T>
struct BoostSpsc {
    static constexpr const char* kName = "boost_spsc_queue";
    bool push(const T& item) { return queue.push(item); }
    bool pop(T& item) { return queue.pop(item); }
    std::size_t push_some(std::span<const T> items) { return queue.push(items.data(), items.size()); }
    std::size_t pop_some(std::span<T> items) { return queue.pop(items.data(), items.size()); }
    boost::lockfree::spsc_queue<T, boost::lockfree::capacity<kQueueCapacity>> queue;
};

// ---- slots --------------------------------------------------------------------------------------

template <typename T>
struct QduinoFourSlot {
    static constexpr const char* kName = "qduino_four_slot";
    void write(const T& value) { slot.write(value); }
    void read(T& value) { value = slot.read(); }
    channel::FourSlot<T> slot;
};

template <typename T>
struct MutexSlot {
    static constexpr const char* kName = "mutex";
    void write(const T& value) {
        const std::lock_guard lock{mutex};
        held = value;
    }
    void read(T& value) {
        const std::lock_guard lock{mutex};
        value = held;
    }
    std::mutex mutex;
    T held{};
};

/// Even: at rest; odd: being written. The reader tries again until it saw one even number on both
/// sides. The words are relaxed atomics, without which the overlapping copy would be a data race
/// (H. Boehm, "Can seqlocks get along with programming language memory models?", MSPC 2012).
template <typename T>
struct Seqlock {
    static constexpr const char* kName = "seqlock";
    static constexpr std::size_t kWords = sizeof(T) / sizeof(std::uint64_t);

    void write(const T& value) {
        const std::uint64_t before = sequence.load(std::memory_order_relaxed);
        sequence.store(before + 1, std::memory_order_relaxed);
        std::atomic_thread_fence(std::memory_order_release);
        for (std::size_t i = 0; i < kWords; ++i) words[i].store(value.words[i], std::memory_order_relaxed);
        sequence.store(before + 2, std::memory_order_release);
    }
    void read(T& value) {
        std::uint64_t before, after;
        do {
            before = sequence.load(std::memory_order_acquire);
            for (std::size_t i = 0; i < kWords; ++i)
                value.words[i] = words[i].load(std::memory_order_relaxed);
            std::atomic_thread_fence(std::memory_order_acquire);
            after = sequence.load(std::memory_order_relaxed);
        } while (before != after || before % 2 != 0);
    }
    alignas(channel::kCacheLine) std::atomic<std::uint64_t> sequence{0};
    alignas(channel::kCacheLine) std::array<std::atomic<std::uint64_t>, kWords> words{};
};

}  // namespace qduino::bench
