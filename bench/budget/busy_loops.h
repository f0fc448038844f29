// A loop that never waits, under a budget: how long it runs at a stretch, and how much of the core
// it gets.
//
//   wall clock   ███████████··························███████████························███
//                └── burst ┘└── held back (> gap) ───┘└── burst ┘
//
// The loop reads the clock every 30 ns or so. Two readings further apart than `gap` are the end of
// one burst and the start of the next.
#pragma once

#include <string>
#include <vector>

#include "base/time.h"
#include "bench/rig/report.h"

namespace qduino::bench {

struct BudgetCase {
    Nanoseconds budget;
    Nanoseconds period;
};

struct Bursts {
    /// Lengths of whole bursts, by the wall clock: the time that another task has to wait.
    std::vector<std::int64_t> lengths_ns;
    double utilisation = 0;  ///< CPU time over wall time, from one burst's start to a later one's
    /// CPU time of the thread outside of its bursts, for each of them: what being held back costs.
    double overhead_ns = 0;
    Json guarantee;
    std::string failure;
};

/// SCHED_FIFO at the board's priority on the last core, its budget kept by sched/'s sporadic
/// server.
Bursts run_under_sporadic_server(BudgetCase budget, Nanoseconds length);
/// The least that a thread can do to hold itself back: a timer of `budget`, in whose handler it
/// sleeps to the next point of a grid, and no account of anything. What it costs is the computer's.
Bursts run_under_bare_timer(BudgetCase budget, Nanoseconds length);
/// The kernel's constant-bandwidth server, with the same budget and period. Needs root.
Bursts run_under_sched_deadline(BudgetCase budget, Nanoseconds length);

}  // namespace qduino::bench
