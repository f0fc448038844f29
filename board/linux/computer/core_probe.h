// Measures what is left on a core: interrupts per second, and the worst gap that a bare spin sees.
#pragma once

#include <functional>
#include <string>

#include "base/time.h"
#include "board/linux/kernel/cpu_list.h"

namespace qduino::board::linux {

/// Cores whose tick stops while one task runs on them (booted with nohz_full).
CpuList tickless_cores(const std::string& root = "");

/// Cores that run only tasks which ask for them (booted with isolcpus).
CpuList isolated_cores(const std::string& root = "");

struct CoreProbe {
    bool real_time = false;             ///< the probe had the priority it asked for
    double interrupts_per_second = -1;  ///< −1: not readable
    Nanoseconds worst_gap{0};           ///< −1: not measured
};

/// Spins for `duration` on `core` at SCHED_FIFO `priority` (0: unchanged), in a thread of its own.
/// `enter` runs on that thread first (to get into the core's cpuset). Blocks for as long.
/// Setup-time.
CoreProbe probe_core(int core, Nanoseconds duration, int priority, const std::function<void()>& enter = {});

}  // namespace qduino::board::linux
