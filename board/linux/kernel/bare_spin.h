// A bare spin: looks at the clock again and again. Where that jumps, something else ran: a tick, a
// top half, a softirq, another task, or what a hypervisor takes. No counter of the kernel has their
// lengths.
//
//   spin  ▪▪▪▪▪▪▪▪▪▪▪      ▪▪▪▪▪▪▪▪▪▪▪▪▪▪   ▪▪▪▪▪▪▪▪
//                     └────┘              └─┘            gaps
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <system_error>
#include <thread>

#include "base/time.h"
#include "board/linux/kernel/clock.h"
#include "board/linux/kernel/core_times.h"
#include "board/linux/kernel/fatal_signals.h"
#include "board/linux/kernel/futex.h"
#include "board/linux/kernel/real_time_thread.h"

namespace qduino::board::linux {

/// Spins for `duration`, and calls `look` with the time between each two looks at the clock: some
/// 50 ns where nothing came between. Returns how long it has spun.
template <typename Look>
Nanoseconds spin_and_look(Nanoseconds duration, Look look) {
    const Instant start = monotonic_now();
    Instant last = start;
    while (last - start < duration) {
        const Instant now = monotonic_now();
        look(now - last);
        last = now;
    }
    return last - start;
}

/// The same on `core`, which the calling thread is bound to. Returns how many interrupts a second
/// the core has served meanwhile; nothing when that cannot be read.
template <typename Look>
std::optional<double> spin_and_count(int core, Nanoseconds duration, Look look) {
    const auto before = interrupts_of(core);
    const Nanoseconds spun = spin_and_look(duration, look);
    const auto after = interrupts_of(core);
    if (!before || !after) return std::nullopt;
    return static_cast<double>(*after - *before) / to_seconds(spun);
}

/// How long a thread of run_apart() may take before it is taken off its core.
inline constexpr Nanoseconds kApartAtMost = 5s;

/// Runs `work` in a thread of its own, which no signal stops, and waits for it. Bounded: where a
/// task of higher rank has the core that `work` goes to, it gets all cores after kApartAtMost, and
/// ends on another. False then: it did not run where it should; and where no thread was to be had.
template <typename Work>
[[nodiscard]] bool run_apart(Work work) {
    std::atomic<std::uint32_t> ended{0};
    std::thread thread;
    try {
        const StopSignalsBlocked for_the_thread;
        thread = std::thread{[&] {
            work();
            ended = 1;
            futex_wake_all(ended);
        }};
    } catch (const std::system_error&) {
        return false;
    }
    const bool in_time = wait_or_free([&ended] { return ended != 0; }, monotonic_now() + kApartAtMost,
                                      [&ended](Instant until) { futex_wait_until(ended, 0, until); },
                                      [&thread] { widen(thread.native_handle()); });
    thread.join();
    return in_time;
}

}  // namespace qduino::board::linux
