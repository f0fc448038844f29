// Between loops: the ring, the four-slot and the mutex, in the sketch's words, and Qduino's C-style
// names for them.
//
//   RingBuffer<T, N>   every item, in order; the writer waits (or is refused) only when it is full,
//                      the reader only when it is empty
//   Channel<T>         the freshest whole value; neither side ever waits
//   Mutex              one loop at a time; a waiter lends its rank to the holder (lock.h)
//
// One loop writes, one loop reads. T is plain bytes (trivially copyable). They stand at global
// scope and cost no heap. They are wait-free, except where write() and read() are asked to wait;
// they do so asleep. (Semi-asynchronous and asynchronous communication as in Qduino: Cheng, Li,
// West, RTSS 2015.)
#pragma once

#include <bit>
#include <cstddef>

#include "arduino/core/lock.h"
#include "arduino/core/loops.h"
#include "board/board.h"
#include "channel/four_slot.h"
#include "channel/ring_buffer.h"

/// At most N items.
template <typename T, std::size_t N>
class RingBuffer {
  public:
    /// Waits while full. False only when the sketch is being stopped.
    bool write(const T& item) {
        while (!tryWrite(item)) {
            if (qduino::board::current().stop_requested()) return false;
            wait();
        }
        return true;
    }
    /// False, and nothing written, when full.
    [[nodiscard]] bool tryWrite(const T& item) { return ring_.size() < N && ring_.try_push(item); }

    /// Waits while empty. When the sketch is being stopped, a T{}.
    T read() {
        T item{};
        read(item);
        return item;
    }
    /// Waits while empty. False, and `item` unchanged, only when the sketch is being stopped.
    bool read(T& item) {
        while (!tryRead(item)) {
            if (qduino::board::current().stop_requested()) return false;
            wait();
        }
        return true;
    }
    /// False, and `item` unchanged, when empty.
    [[nodiscard]] bool tryRead(T& item) { return ring_.try_pop(item); }

    /// Items that can be read, and written, now.
    [[nodiscard]] std::size_t available() const { return ring_.size(); }
    [[nodiscard]] std::size_t availableForWrite() const { return N - ring_.size(); }
    static constexpr std::size_t capacity() { return N; }
    /// Reader only: drops what is held.
    void clear() { ring_.discard_all(); }

  private:
    static constexpr qduino::Nanoseconds kWaitStep{50'000};
    static void wait() { qduino::board::current().sleep_until(qduino::board::current().now() + kWaitStep); }

    qduino::channel::RingBuffer<T, std::bit_ceil(N)> ring_;
};

/// Before the first write, read() gives zeroes.
template <typename T>
class Channel {
  public:
    void write(const T& value) { slots_.write(value); }
    [[nodiscard]] T read() const { return slots_.read(); }

  private:
    qduino::channel::FourSlot<T> slots_;
};

/// Mutual exclusion between loops, recursive. A wait consumes no budget. On one core it lasts at
/// most the critical sections of others; for a holder on another core also what ranks above both
/// there. Admission counts it (blocking.h, remote_blocking.h). Tell it in setup() how long:
///
///   m.heldBy(1, 2ms);   m.heldBy(2, 500us);      loops 1 and 2 hold it so long at the most
///   m.heldBy(handler, 100us);                    and the handler of an interrupt, so long
///
/// A Mutex that says nothing may be held by every loop for its whole budget, as far as admission
/// knows.
class Mutex : public qduino::arduino::SaysWhoHolds<Mutex> {
  public:
    void lock() { lock_.lock(); }
    /// Contract: held by the calling loop.
    void unlock() { lock_.unlock(); }
    /// False when another loop holds it.
    [[nodiscard]] bool tryLock() { return lock_.try_lock(); }
    [[nodiscard]] bool try_lock() { return lock_.try_lock(); }  ///< for std::unique_lock

  private:
    friend class qduino::arduino::SaysWhoHolds<Mutex>;
    qduino::arduino::Lock lock_{"a Mutex", qduino::runtime::Unsaid::whole_budgets};
};

/// Qduino's word. Spinning would hang two loops of one core: it is a Mutex.
using Spinlock = Mutex;

// ---- Qduino's names: 0 is success, -1 is full (empty) -------------------------------------------
using spinlock_t = Spinlock;
inline int spinlockInit(Spinlock*) { return 0; }
inline void spinlockLock(Spinlock* lock) { lock->lock(); }
inline void spinlockUnlock(Spinlock* lock) { lock->unlock(); }

template <typename T>
int channelInit(Channel<T>* channel) {
    channel->write(T{});
    return 0;
}
template <typename T>
int channelWrite(Channel<T>* channel, const T& value) {
    channel->write(value);
    return 0;
}
template <typename T>
int channelRead(const Channel<T>* channel, T* value) {
    *value = channel->read();
    return 0;
}
template <typename T, std::size_t N>
int ringbufInit(RingBuffer<T, N>* ring) {
    ring->clear();
    return 0;
}
template <typename T, std::size_t N>
int ringbufWrite(RingBuffer<T, N>* ring, const T& item) {
    return ring->tryWrite(item) ? 0 : -1;
}
template <typename T, std::size_t N>
int ringbufRead(RingBuffer<T, N>* ring, T* item) {
    return ring->tryRead(*item) ? 0 : -1;
}
