// Measures what the platform takes of a loop's budget on this computer: for admission
// (sched/admission.h).
#pragma once

#include <string>

#include "sched/admission.h"

namespace qduino::board::linux {

/// Medians over some 10 ms of sleeping and of timer signals on the calling thread. The kernel's
/// fair server is left out. It runs above real-time threads only on a core where ordinary threads
/// found no room for a second, and enforced budgets leave them that room: admission gives no shared
/// core away to 100 % of all time.
[[nodiscard]] sched::PlatformOverheads measure_overheads();

/// The share of a core's time that a real-time thread may spin without the kernel holding it for
/// tens of milliseconds. 1 where RT throttling is lifted, else a little less than it grants. `root`
/// precedes /proc (tests).
[[nodiscard]] double real_time_share(const std::string& root = "");

}  // namespace qduino::board::linux
