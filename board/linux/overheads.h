// What the platform takes of a loop's budget, measured on this machine: for admission (sched/admission.h).
#pragma once

#include <string>

#include "sched/admission.h"

namespace qduino::board::linux {

/// Medians over some 10 ms of sleeping and of timer signals on the calling thread. The kernel's fair server
/// is left out: it runs above real-time threads only on a core where ordinary ones have found no room for a
/// second, and the budgets that are enforced leave them that (admission never gives all of a shared core away).
[[nodiscard]] sched::PlatformOverheads measure_overheads();

/// Of a core's time, what a real-time thread may spin through without being held by the kernel for tens of milliseconds: 1 where RT
/// throttling is lifted, else a little less than it grants. `root` precedes /proc (tests).
[[nodiscard]] double real_time_share(const std::string& root = "");

}  // namespace qduino::board::linux
