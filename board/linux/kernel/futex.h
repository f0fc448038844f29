// Waiting for a word of (shared) memory to change: the futex(2) system call, which works across
// processes.
#pragma once

#include <linux/futex.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <climits>
#include <cstdint>

#include "board/linux/kernel/clock.h"

namespace qduino::board::linux {

static_assert(sizeof(std::atomic<std::uint32_t>) == sizeof(std::uint32_t) &&
              std::atomic<std::uint32_t>::is_always_lock_free);

/// Sleeps until `word` no longer holds `expected`, until a waker or a signal comes, or until
/// CLOCK_MONOTONIC reaches `deadline`. The caller must look again. Does not sleep when `word`
/// differs already.
inline void futex_wait_until(const std::atomic<std::uint32_t>& word, std::uint32_t expected,
                             Instant deadline) {
    const timespec until = to_timespec(to_ns(deadline));
    // FUTEX_WAIT_BITSET takes an absolute time of CLOCK_MONOTONIC, so a signal in between does not
    // stretch the wait.
    ::syscall(SYS_futex, &word, FUTEX_WAIT_BITSET, expected, deadline == kForever ? nullptr : &until, nullptr,
              FUTEX_BITSET_MATCH_ANY);
}

/// Wakes every waiter on `word`. Async-signal-safe.
inline void futex_wake_all(const std::atomic<std::uint32_t>& word) {
    ::syscall(SYS_futex, &word, FUTEX_WAKE, INT_MAX, nullptr, nullptr, 0);
}

/// Takes a lock that this process's threads share, with priority inheritance: 0 is free, else it
/// holds the holder's thread id (futex(2), FUTEX_LOCK_PI). Waits while another thread has it.
/// Returns 0 or the system's error, but never EINTR or EAGAIN.
inline int futex_lock_inheriting(std::atomic<std::uint32_t>& word) {
    for (;;) {
        if (::syscall(SYS_futex, &word, FUTEX_LOCK_PI_PRIVATE, 0, nullptr, nullptr, 0) == 0) return 0;
        if (errno != EINTR && errno != EAGAIN) return errno;
    }
}

/// Hands the lock to the waiter of highest priority. Returns 0 or the system's error (EPERM: the
/// caller does not hold it).
inline int futex_unlock_inheriting(std::atomic<std::uint32_t>& word) {
    return ::syscall(SYS_futex, &word, FUTEX_UNLOCK_PI_PRIVATE, 0, nullptr, nullptr, 0) == 0 ? 0 : errno;
}

}  // namespace qduino::board::linux
