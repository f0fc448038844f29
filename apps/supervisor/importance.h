// The real-time priority of those who outlive the sketch, and what bounds it.
//
//   sketch's loops ≤ 80  <  its death witness 89  <  supervisor 90  <  heat watch 91
//
// At these priorities a loop that never blocks holds a core against everybody, the kernel's own threads too. So
//  - nothing that may wait inside the kernel for ordinary processes is done at them: a dead child is reaped after step_down()
//    (release_task() → shrink_dcache_parent() busy-waits for whoever reads its files in /proc);
//  - every loop is paced (Pace): a turn begins 1 ms after the one before at the earliest, whatever the calls in it answer;
//  - a budget like everybody's (RLIMIT_RTTIME): who consumes kBudget without blocking gets SIGXCPU, and its handler steps down;
//    kHardLimit on, where this process may set such a limit and give its child the old one, the kernel ends the process.
#pragma once

#include "base/time.h"
#include "board/linux/clock.h"

namespace qduino::supervisor {

inline constexpr int kSupervisorPriority = 90;
inline constexpr int kHeatWatchPriority = 91;
inline constexpr Nanoseconds kBudget = 50ms;
inline constexpr Nanoseconds kHardLimit = 1s;

/// SCHED_FIFO at `priority`, memory locked, the budget set anew; children start as ordinary processes. Asked for, not demanded: an
/// ordinary user gets none of it. One thread.
void rise(int priority);
/// Back to ordinary scheduling. Async-signal-safe.
void step_down();
/// The budget was spent since the last rise(): the process has been ordinary since.
bool budget_was_spent();
/// In a child: the limit as it was before rise(). Async-signal-safe.
void restore_real_time_limit();

/// Paces a loop.
class Pace {
  public:
    static constexpr Nanoseconds kShortestTurn = 1ms;

    /// At the beginning of every turn: sleeps when the last one began less than kShortestTurn ago.
    void next_turn() {
        board::linux::block_until(next_);
        next_ = board::linux::monotonic_now() + kShortestTurn;
    }

  private:
    Instant next_ = kEpoch;
};

}  // namespace qduino::supervisor
