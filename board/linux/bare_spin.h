// A bare spin: looks at the clock again and again. Where that jumps, something else ran: a tick, a
// top half, a softirq, another task, or what a hypervisor takes. No counter of the kernel has their
// lengths.
//
//   spin  ▪▪▪▪▪▪▪▪▪▪▪      ▪▪▪▪▪▪▪▪▪▪▪▪▪▪   ▪▪▪▪▪▪▪▪
//                     └────┘              └─┘            gaps
#pragma once

#include <cstdint>
#include <optional>
#include <system_error>
#include <thread>

#include "base/time.h"
#include "board/linux/clock.h"
#include "board/linux/core_times.h"
#include "board/linux/fatal_signals.h"

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

/// Runs `work` in a thread of its own, which no signal stops, and waits for it. False: there is no
/// thread to be had, and `work` has not run.
template <typename Work>
[[nodiscard]] bool run_apart(Work work) {
    const StopSignalsBlocked for_the_thread;
    try {
        std::thread{work}.join();
    } catch (const std::system_error&) {
        return false;
    }
    return true;
}

}  // namespace qduino::board::linux
