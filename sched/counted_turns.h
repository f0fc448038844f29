// Which turns to a loop are in the R of the loops below it, and which the loop pays for itself.
//
// A turn is the switch to a loop and the one back to what it displaces. Admission counts one in
// each period, for a release or for the end of a pause for want of budget, and one for each sleep
// and each wait for a lock that the loop declares (load.h: per_release()). A loop that gives the
// core up more often would take that time from those below it, in nobody's R and nobody's budget.
// So it pays for each further turn out of its own budget:
//
//   period   │ release      sleep, declared    sleep, undeclared  │ release
//   turn     │ counted      counted            paid               │ counted
//
// On Linux a thread's budget has the cost of its turns in it anyway (budget_account.h).
#pragma once

#include "base/time.h"
#include "sched/vcpu.h"

namespace qduino::sched {

/// One loop's turns, on its core. No call blocks or allocates.
class CountedTurns {
  public:
    /// It begins a release, which declares so many waits for locks.
    void release(const Vcpu& loop, int requests) {
        sleeps_left_ = loop.times_asleep();
        requests_left_ = requests;
    }
    /// It wakes; that was due at `due`. False: it pays. So of the next two.
    [[nodiscard]] bool counts_wake(const Vcpu& loop, Instant due) {
        return counts_once(loop, due) || --sleeps_left_ >= 0;
    }
    /// It has spent its budget, and will have some at `replenished`.
    [[nodiscard]] bool counts_pause(const Vcpu& loop, Instant replenished) {
        return counts_once(loop, replenished);
    }
    /// It was given a lock that it has waited for.
    [[nodiscard]] bool counts_wait() { return --requests_left_ >= 0; }

  private:
    [[nodiscard]] bool counts_once(const Vcpu& loop, Instant begin) {
        if (begin < counts_at_) return false;
        counts_at_ = begin + loop.period;
        return true;
    }

    Instant counts_at_ = Instant::min();  // it counts the next turn then
    int sleeps_left_ = 0, requests_left_ = 0;
};

}  // namespace qduino::sched
