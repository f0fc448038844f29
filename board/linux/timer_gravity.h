// How much earlier a loop's alarm is set, for the way from the timer's interrupt to the loop's first instruction.
//
//                        due                                                          due
//   plain                 ▼ timer                     with gravity    timer            ▼
//                         ├──── wake-up ────┤ body                    ├──── wake-up ────┤ body
//                                                                     ├ wake-up ┤ spin ┤ body     one in eight, a quick one
//
// A wake-up takes 5 to 20 us, nearly always: the interrupt, the way out of an idle core (out of the hypervisor, in a virtual machine),
// the switch. What it nearly always takes can be had before the loop is due. Xenomai does so with all its timers and calls it the
// clock's gravity (its program `autotune` measures it once). Here each loop learns its own while it runs, as the eighth of its wake-ups
// that are quickest: those come early and spin the rest, a few microseconds that are charged to its budget. An alarm may be late,
// never early: the caller waits for the instant itself.
//
// The eighth is found by steps: down by 7 after a wake-up that was quicker, up by 1 after one that was not, so that it stands where
// both are as frequent as that (the stochastic approximation of a quantile: Robbins and Monro, 1951). What takes longer than 50 us
// was no wake-up alone, but a stall of the host or another loop with a higher priority, and teaches nothing.
//
// One thread. Time is a parameter.
#pragma once

#include <algorithm>

#include "base/time.h"

namespace qduino::board::linux {

class TimerGravity {
  public:
    /// About to sleep at `now` until `t`, which is later: when to set the alarm. At least half of the wait is slept.
    [[nodiscard]] Instant alarm_for(Instant t, Instant now) {
        learn();
        alarm_ = t - std::min(lead_, (t - now) / 2);
        return alarm_;
    }
    /// It woke at `now`. Only noted: what follows is due.
    void woke(Instant now) { woke_ = now; }

    [[nodiscard]] Nanoseconds lead() const { return lead_; }

    static constexpr Nanoseconds kMost = 50us;
    static constexpr int kFirst = 32;  ///< wake-ups, of which the quickest is where it begins

  private:
    void learn() {
        const Nanoseconds took = woke_ - alarm_;
        woke_ = kEpoch;
        if (took <= Nanoseconds{0} || took > kMost) return;
        if (seen_ < kFirst) {
            quickest_ = std::min(quickest_, took);
            if (++seen_ == kFirst) lead_ = quickest_;
        } else {
            lead_ = std::clamp(lead_ + (took < lead_ ? -7 * kStep : kStep), Nanoseconds{0}, kMost);
        }
    }

    static constexpr Nanoseconds kStep = 50ns;

    Instant alarm_{};
    Instant woke_ = kEpoch;
    Nanoseconds lead_{0};
    Nanoseconds quickest_ = kMost;
    int seen_ = 0;
};

}  // namespace qduino::board::linux
