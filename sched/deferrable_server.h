// Deferrable server: what a loop that sleeps in the middle of a release may run, and when.
//
// A sporadic server gives each piece of budget back one period after its use began. A loop that
// slept before it computed gets its budget back as late in the next release, even if that one does
// not sleep, and misses its period with time to spare. Here the whole budget comes back at once:
//
//   budget 3, period 10        ██ runs     z sleeps     · has work, waits for budget
//
//   t         0  1  2  3  4  5  6  7  8  9 10 11 12 13 14 15 16
//   sporadic  z  z  z  z  z  z  z ██ ██ ██  ·  ·  ·  ·  ·  ·  · ██ ██ ██
//   here      z  z  z  z  z  z  z ██ ██ ██ ██ ██ ██
//
// That has its price: two budgets may follow each other closely, at the end of one period and the
// begin of the next. So admission counts such a loop with a release jitter of period − budget
// (completion_time.h), and gives this server where the others on the core can bear that.
//
// J. Strosnider, J. Lehoczky, L. Sha, "The deferrable server algorithm for enhanced aperiodic
// responsiveness", IEEE Trans. Computers, 1995. What is ours: a period begins with a release, or,
// until that is told, when the loop wakes after the last period has ended; and an overrun is
// charged to the next period. Two periods never begin closer together than one period.
#pragma once

#include "base/time.h"
#include "sched/vcpu.h"

namespace qduino::sched {

/// One owner at a time. No call blocks or allocates.
class DeferrableServer {
  public:
    /// Full budget from `start` on; blocked. Its first period begins with its first work: a board
    /// may take its time between the two. Contract: parameters.valid().
    /// `shortest_run`: a throttled server waits for a period that gives at least this much, up to a
    /// budget. What an overrun left of a period may be less than the way into a sleep and out of it
    /// takes.
    explicit DeferrableServer(VcpuParameters parameters, Instant start = kEpoch,
                              Nanoseconds shortest_run = Nanoseconds{1});

    /// CPU time that it may take from `now` on without a pause: what is left, and the next budget
    /// when that lasts to the period's end. 0 when throttled. Ask it while it has work.
    [[nodiscard]] Nanoseconds available(Instant now) const;
    /// The instant from which it may run; in the future exactly when it is throttled.
    [[nodiscard]] Instant next_replenishment() const;

    /// Charges `used` of CPU time that ended at `now_end` to the periods in which it fell, as if
    /// used in one piece. Returns how much of it exceeded their budgets; that is charged to the
    /// next period. Contract: used >= 0.
    Nanoseconds consume(Instant now_end, Nanoseconds used);
    /// The VCPU has work again. No effect when it already had.
    void unblock(Instant now);
    /// The VCPU has no work. Charge what it has used first.
    void block(Instant now);
    /// A release of the loop was due at `nominal`: a period begins there, if the last one has ended
    /// by then. An interrupt may have made the wake-up later, and an alarm that knows itself to be
    /// late has made it earlier.
    void release(Instant nominal);

    [[nodiscard]] bool blocked() const { return blocked_; }
    /// Charged so far, ever.
    [[nodiscard]] Nanoseconds consumed() const { return consumed_; }
    [[nodiscard]] const VcpuParameters& parameters() const { return parameters_; }

  private:
    struct Period {
        Instant begin;
        Nanoseconds left;  // below 0 after an overrun
        Instant earliest;  // a release may move the begin, down to here
    };
    /// The period that `now` is in, when there was work all the time since the last one.
    [[nodiscard]] Period period_at(Instant now) const;

    VcpuParameters parameters_{};
    Period period_{};
    Nanoseconds shortest_run_{};
    Nanoseconds consumed_{};
    bool blocked_ = true;
    bool had_work_ = false;
};

}  // namespace qduino::sched
