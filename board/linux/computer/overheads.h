// Measures what the platform takes of a loop's budget on this computer: for admission
// (sched/admission.h).
#pragma once

#include <string>

#include "sched/admission.h"

namespace qduino::board::linux {

/// Medians over some 10 ms of sleeping and of timer signals on the calling thread: what an
/// activation costs beside its budget.
///
///   in the budget     all CPU time of the thread, the handler of the budget's timer as well, and
///                     the way through every sleep but one in each period (sched/budget_account.h)
///   release           that one way
///   enforcement       the timer's interrupt and signal: they may come while another loop runs
[[nodiscard]] sched::PlatformOverheads measure_overheads();

/// Adds what the kernel keeps for ordinary tasks (its fair server, or RT throttling): by default 50
/// ms in each second, where real-time threads leave less. `root` precedes /proc (tests).
void keep_for_ordinary_tasks(sched::PlatformOverheads& overheads, const std::string& root = "");

/// The warden's looks at the loops of a sketch (warden.h), as measured by waits and readings of the
/// calling thread: above every loop, on any core that no loop owns.
[[nodiscard]] sched::PlatformInterferer warden_looks(Nanoseconds wait);

/// The share of a core's time that a real-time thread may spin without the kernel holding it for
/// tens of milliseconds. 1 where RT throttling is lifted, else a little less than it grants. `root`
/// precedes /proc (tests).
[[nodiscard]] double real_time_share(const std::string& root = "");

}  // namespace qduino::board::linux
