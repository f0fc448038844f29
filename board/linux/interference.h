// What interrupts take of a core on this computer: ticks, top halves, softirqs, and what a
// hypervisor takes. No counter of the kernel has their cost, so a bare spin measures it
// (bare_spin.h). Its gaps above 1 us count.
#pragma once

#include <cstddef>

#include "base/time.h"
#include "sched/load.h"

namespace qduino::board::linux {

struct Interference {
    bool measured = false;
    double per_second = 0;  ///< of the gaps, or of the kernel's own count where that is higher
    Nanoseconds usual{};    ///< nine in ten gaps are no longer
    Nanoseconds longest{};  ///< all but one are no longer
    Nanoseconds worst{};    ///< that one: perhaps a stall of the host

    /// For admission: 1.5 times the rate and 1.5 times the usual length, two at once.
    [[nodiscard]] sched::PlatformInterferer counted() const;
    /// And once in every busy window 1.5 times the longest that came twice. The worst gap is
    /// reported and not counted: one stall of a host, which is milliseconds, would refuse every
    /// sketch.
    [[nodiscard]] sched::PlatformInterferer counted_once() const;
};

/// Spins for `duration` on `core` at SCHED_FIFO `priority`, in a thread of its own; blocks for as
/// long. Not measured: without that priority a gap may be any task's. Setup-time.
[[nodiscard]] Interference measure_interference(int core, Nanoseconds duration, int priority);

}  // namespace qduino::board::linux
