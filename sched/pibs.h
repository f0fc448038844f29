// PIBS, the priority-inheriting bandwidth-preserving server: what an I/O VCPU (a bottom half) may run, and when.
//
// A bottom half works for a main VCPU. It inherits that one's period T as its priority, and gets the share
// U of it:
//
//   U = 1/4, client T = 16:   budget U·T = 4
//
//        e               e + used/U
//        |████           |████              used all 4:  eligible again 16 after e
//        |█  |████                          used 1:      eligible again  4 after e, with a budget of U·T
//
//   - one replenishment, not a list: at (instant it became eligible) + used/U; it does not run before it;
//   - a client with a shorter period that comes during service raises it: the priority becomes the new
//     client's, and the budget that remains is clamped to U·T_new, or it would run at the new priority
//     with the old one's bigger budget;
//   - what it uses after a raise is charged from the raise: a service that was held up at the old priority
//     for long would else be replenished at once at the new one, and break the window bound there;
//   - time used beyond the budget is part of `used`: an overrun moves the replenishment, never forgiven.
//
// E. Missimer, K. Zhao, R. West, "Mixed-criticality scheduling with I/O", ECRTS 2016; M. Danish, Y. Li,
// R. West, "Virtual-CPU scheduling in the Quest operating system", RTAS 2011. Charging from the raise is ours:
// it delays, never advances, a replenishment; the property tests show that without it the bound fails.
//
// Window bound, at the priority of client period T and above, while nothing of higher priority holds it up:
// in every window of length t >= U·T it consumes at most U·(t − U·T) + U·T, that is (2 − U)·U·T in one period.
//
// Invariants: remaining <= U·T; the replenishment never moves back; rounding is against the server (budget
// down, replenishment up).
#pragma once

#include "base/time.h"
#include "sched/vcpu.h"

namespace qduino::sched {

/// One owner at a time. No call blocks or allocates. `now` must not run backwards from call to call.
class Pibs {
  public:
    Pibs() = default;  ///< for containers only: assign before use
    /// U = budget / period. Idle, eligible from `start` on. Contract: parameters.valid().
    explicit Pibs(VcpuParameters parameters, Instant start = kEpoch);

    /// Work has come on behalf of a main VCPU of period `client_period` (> 0). Idle: takes that priority and
    /// the budget U·T, once eligible. Serving: raised if the new client's period is shorter, else unchanged.
    /// When it runs now, charge it first.
    void activate(Instant now, Nanoseconds client_period);
    /// The bottom half has no work left. Charge it first.
    void finish(Instant now);
    /// Charges `used` of CPU time that ended at `now_end`. Contract: used >= 0.
    void consume(Instant now_end, Nanoseconds used);

    /// CPU time it may take from `now` on; 0 when idle or throttled.
    [[nodiscard]] Nanoseconds available(Instant now) const;
    /// Has work and may run.
    [[nodiscard]] bool eligible(Instant now) const { return available(now) > Nanoseconds{0}; }
    /// The instant from which it may run (again): in the future exactly when it is throttled.
    [[nodiscard]] Instant next_replenishment() const { return eligible_from_; }

    [[nodiscard]] bool idle() const { return !active_; }
    /// The inherited period, its priority. Contract: not idle.
    [[nodiscard]] Nanoseconds client_period() const;
    [[nodiscard]] const VcpuParameters& parameters() const { return parameters_; }
    /// Charged so far, ever.
    [[nodiscard]] Nanoseconds consumed() const { return consumed_; }

    /// U·T, rounded down, at least 1 ns.
    [[nodiscard]] Nanoseconds budget_for(Nanoseconds client_period) const;
    /// used/U, rounded up: how long `used` takes to come back.
    [[nodiscard]] Nanoseconds recovery_of(Nanoseconds used) const;

  private:
    void open_service(Instant now);
    void close_service();
    void raise(Instant now, Nanoseconds client_period);

    VcpuParameters parameters_{};
    Instant eligible_from_{};      // start of the present service, or of the next one
    Instant charged_from_{};       // `used_` comes back at charged_from_ + used_/U
    Nanoseconds client_period_{};  // of the present work
    Nanoseconds remaining_{};      // of the present service
    Nanoseconds used_{};           // since charged_from_
    Nanoseconds consumed_{};
    bool active_ = false;  // has work
};

}  // namespace qduino::sched
