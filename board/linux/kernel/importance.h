// The real-time priority of the processes that outlive the sketch, and its bounds.
//
//   sketch's loops ≤ 80  <  its death witness 89  <  supervisor 90  <  heat watch 91
//
// At these priorities a loop that never blocks holds a core against everything else, the kernel's
// own threads included. So
// - a process does nothing at them that may wait inside the kernel for ordinary processes. It reaps
//   a dead child after step_down(): release_task() → shrink_dcache_parent() busy-waits for any
//   reader of the child's files in /proc.
// - every loop is paced (Pace): a turn begins at the earliest 1 ms after the one before, whatever
//   the calls in it answer.
// - each has a budget (RLIMIT_RTTIME). A process that consumes kBudget without blocking gets
//   SIGXCPU, and the handler steps down. At kHardLimit the kernel ends the process, where this
//   process may set such a limit and give its child the old one.
#pragma once

#include "base/time.h"
#include "board/linux/kernel/clock.h"

namespace qduino::importance {

inline constexpr int kSupervisorPriority = 90;
inline constexpr int kHeatWatchPriority = 91;
inline constexpr Nanoseconds kBudget = 50ms;
inline constexpr Nanoseconds kHardLimit = 1s;

/// Sets SCHED_FIFO at `priority`, locks memory, and starts the budget anew; children start as
/// ordinary processes. It is a request: an ordinary user gets none of it. One thread.
void rise(int priority);
/// Back to ordinary scheduling. Async-signal-safe.
void step_down();
/// True when the budget was spent since the last rise(): the process has been ordinary since then.
bool budget_was_spent();
/// In a child: restores the limit from before rise(). Async-signal-safe.
void restore_real_time_limit();

/// Paces a loop.
class Pace {
  public:
    static constexpr Nanoseconds kShortestTurn = 1ms;

    /// Call at the beginning of every turn: sleeps when the last one began less than kShortestTurn
    /// ago.
    void next_turn() {
        board::linux::block_until(next_);
        next_ = board::linux::monotonic_now() + kShortestTurn;
    }

  private:
    Instant next_ = kEpoch;
};

}  // namespace qduino::importance
