// PIBS, the priority-inheriting bandwidth-preserving server: what an I/O VCPU (a bottom half) may
// run, and when.
//
// A bottom half works for a main VCPU, its client. It takes the client's period T as its priority,
// and gets the share U of it:
//
//   U = 1/4, client T = 16:   budget U·T = 4
//
//        e               e + used/U
//        |████           |████              used all 4:  eligible again 16 after e
//        |█  |████                          used 1:      eligible again  4 after e, budget U·T
//
// - There is one replenishment and no list. It comes at (instant it became eligible) + used/U, and
//   the server does not run before it.
// - A client with a shorter period may come during service. It raises the server: the priority
//   becomes the new client's, and the remaining budget is clamped to U·T_new. Otherwise the server
//   would run at the new priority with the bigger budget of the old one.
// - Use after a raise is charged from the raise. Otherwise a service that was held up for long at
//   the old priority would be replenished at once at the new one, and break the window bound there.
// - Time used beyond the budget is part of `used`: an overrun moves the replenishment and is never
//   forgiven. It begins no further service before that, in however many pieces it is charged: one
//   piece, of a late timer, counts as if it were charged ns by ns.
// - A service that has not begun when the work is done costs nothing, no activation either: nothing
//   has turned to it.
// - U may change. The service in hand then ends, what it used comes back at the old U, and the next
//   service has the budget of the new one. So the services before the change and those after it
//   together take no more than a server that always had the greater U.
//
// E. Missimer, K. Missimer, R. West, "Mixed-criticality scheduling with I/O", ECRTS 2016;
// M. Danish, Y. Li, R. West, "Virtual-CPU scheduling in the Quest operating system", RTAS 2011.
// Charging from the raise is ours. It delays a replenishment and never advances one; the property
// tests show that the bound fails without it.
//
// Window bound, at the priority of client period T and above, while nothing of higher priority
// holds it up: in every window of length t >= U·T it consumes at most U·(t − U·T) + U·T, which is
// (2 − U)·U·T in one period.
//
// Invariants: remaining <= U·T; the replenishment never moves back; rounding is against the server
// (budget down, replenishment up).
#pragma once

#include "base/time.h"
#include "sched/vcpu.h"

namespace qduino::sched {

/// One owner at a time. No call blocks or allocates. `now` must not run backwards from call to
/// call.
class Pibs {
  public:
    Pibs() = default;  ///< for containers only: assign before use
    /// U = budget / period. Idle, eligible from `start` on. Contract: parameters.valid().
    /// `activation`: what each service that begins costs the core beside its work. The service pays
    /// for it, so that many short ones take no more than one long one.
    /// `client_period`: the period of the main VCPU that it works for where none is named; 0: its
    /// own.
    explicit Pibs(VcpuParameters parameters, Instant start = kEpoch, Nanoseconds activation = {},
                  Nanoseconds client_period = {});

    /// Work has come on behalf of a main VCPU of period `client_period` (> 0). An idle server takes
    /// that priority, and the budget U·T once it is eligible. A serving one is raised if the new
    /// client's period is shorter, and unchanged otherwise. Charge a server that is running first.
    void activate(Instant now, Nanoseconds client_period);
    /// The bottom half has no work left. Charge it first.
    void block(Instant now);
    /// U = budget / period from now on. Charge it first. Contract: parameters.valid().
    void change(Instant now, VcpuParameters parameters);
    /// Charges `used` of CPU time that ended at `now_end`. Returns what exceeded the budget.
    /// Contract: used >= 0.
    Nanoseconds consume(Instant now_end, Nanoseconds used);

    /// The client's period where none is named.
    [[nodiscard]] Nanoseconds usual_client() const { return usual_client_; }
    /// CPU time it may take from `now` on; 0 when idle or throttled.
    [[nodiscard]] Nanoseconds available(Instant now) const;
    /// Has work and may run.
    [[nodiscard]] bool eligible(Instant now) const { return available(now) > Nanoseconds{0}; }
    /// The instant from which it may run. It is in the future exactly when the server is throttled.
    [[nodiscard]] Instant next_replenishment() const { return eligible_from_; }

    [[nodiscard]] bool blocked() const { return !active_; }
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
    void run_without_budget(Nanoseconds used);
    void raise(Instant now, Nanoseconds client_period);

    VcpuParameters parameters_{};
    Nanoseconds activation_{};
    Nanoseconds usual_client_{};
    Instant eligible_from_{};      // start of the present service, or of the next one
    Instant charged_from_{};       // `used_` comes back at charged_from_ + used_/U
    Nanoseconds client_period_{};  // of the present work
    Nanoseconds remaining_{};      // of the present service
    Nanoseconds used_{};           // since charged_from_
    Nanoseconds last_used_{};      // of the service before
    Nanoseconds consumed_{};
    bool active_ = false;  // has work
};

}  // namespace qduino::sched
