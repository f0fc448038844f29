// The clocks of stock Linux as Instants.
//
// Everything that crosses a process is timed by CLOCK_MONOTONIC, read through the vDSO (23 ns where
// the TSC is the clock source; EPYC VM, kernel 6.18). It is slewed, never stepped. Loops read the
// same time by a shorter way: cycle_clock.h.
#pragma once

#include <time.h>

#include <cerrno>
#include <cstdint>

#include "base/time.h"

namespace qduino::board::linux {

inline std::int64_t read_clock_ns(clockid_t clock) {
    timespec t{};
    ::clock_gettime(clock, &t);
    return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
}

/// Now, on the clock that every process of this computer shares. Real-time safe, async-signal-safe.
inline Instant monotonic_now() { return instant_from_ns(read_clock_ns(CLOCK_MONOTONIC)); }

/// CPU time that the calling thread has consumed. A system call (about 0.5 µs). Async-signal-safe.
inline Nanoseconds thread_cpu_time() { return Nanoseconds{read_clock_ns(CLOCK_THREAD_CPUTIME_ID)}; }

inline timespec to_timespec(std::int64_t ns) {
    timespec t{};
    t.tv_sec = ns / 1'000'000'000;
    t.tv_nsec = ns % 1'000'000'000;
    return t;
}

/// Blocks until CLOCK_MONOTONIC has reached `t`, through signals. Async-signal-safe on Linux (one
/// system call).
inline void block_until(Instant t) {
    if (to_ns(t) <= 0) return;
    const timespec until = to_timespec(to_ns(t));
    while (::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) {
    }
}

}  // namespace qduino::board::linux
