// Admission of a process tree (core_promises.h): does it get its budget in each of its periods,
// below everything that is promised on its core?
//
//   R = C + Σ loops ⌈R/T_j⌉·C_j + Σ I/O VCPUs + platform(R)      every loop, whatever its period
//         + Σ trees min(⌈(R + T_k − C_k)/T_k⌉·C_k + one tick,  C + lag)          <=  T
//
// A tree's tasks are ordinary ones, so every real-time loop comes before them, also one of a longer
// period. The kernel gives the tree its whole budget at the begin of each period (CFS bandwidth
// control, Documentation/scheduler/sched-bwc.rst). Another tree takes no more than either of
//
// - a deferrable server: its budget at the end of a period, and again at the begin of the next
//   (Strosnider, Lehoczky, Sha, IEEE ToC 1995). The kernel notices a spent budget at a tick, and
//   takes back in the next period what was overdrawn: one tick more, once;
// - a fair share: groups of one parent have equal weights, so while this tree waits for its C,
//   the other gets no more than C and the scheduler's lag (Stoica, Abdel-Wahab, "Earliest Eligible
//   Virtual Deadline First", 1995). The lag is counted as 24 ms and a tick: the longest latency of
//   the older fair scheduler (kernel/sched/fair.c, sysctl_sched_latency, from eight cores on).
//
// The test takes one of the two for all other trees: the one that gives the smaller R.
//
// The other half of the promise is not tested here: tasks without a VCPU. A group's weight is the
// highest, so they get little of its core while the tree has budget.
#pragma once

#include <span>
#include <string>

#include "board/linux/computer/core_promises.h"

namespace qduino::board::linux {

struct TreeVerdict {
    bool admitted = false;
    Nanoseconds response{};  ///< R; beyond the period: not followed further
    /// What comes before it on its core: "loop 1 of printer (30 ms in 100 ms)", …; empty: nothing.
    std::string above;
    /// When it is refused: the largest budget in whole milliseconds that is admitted; 0: none.
    Nanoseconds largest{};
    std::string refusal;  ///< one sentence, with what would be admitted; empty when admitted
};

/// `tree` beside `promises`, of which it is none. Set-up time.
[[nodiscard]] TreeVerdict admit_tree(const TreeVcpu& tree, std::span<const Promise> promises);

/// As admit_tree(), but where `tree.budget` is not admitted, `tree` gets the largest that is, from
/// `least` on. Where not even that is, less would gain nothing: it keeps its budget.
[[nodiscard]] TreeVerdict admit_what_fits(TreeVcpu& tree, Nanoseconds least,
                                          std::span<const Promise> promises);

/// As admit_tree(), and every tree of `promises` on that core must still be admitted beside it.
[[nodiscard]] TreeVerdict admit_newcomer(const TreeVcpu& tree, std::span<const Promise> promises);

/// The period of the kernel's tick here.
[[nodiscard]] Nanoseconds tick_period();

}  // namespace qduino::board::linux
