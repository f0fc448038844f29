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
// both are as frequent as that (the stochastic approximation of a quantile: Robbins and Monro, 1951).
//
// What counts as a wake-up follows the machine: on a host that takes 69 us for nearly every one of them, 69 us is no stall. The floor,
// the thirty-second of all wake-ups that are quickest (found in the same way), is what the machine takes when nothing is in the way; what
// takes longer than three times that, and longer than 50 us, was a stall of the host or another loop with a higher priority, and teaches
// nothing. So a loop never spins through more than two of the machine's quickest wake-ups, unless they are below 17 us each.
//
//   0        floor            lead                        3 x floor
//   ├──────────┼───────────────┼──────────────────────────────┼───────────────
//              │ 1/32 quicker  │ 1/8 quicker                  │ teaches nothing
//
// Hard limits: kSlowest for what can be a wake-up at all, half of the wait, and `most` for the lead: the spin is charged to the loop's
// budget, and may never be a large part of it (lead_limit()).
//
// One thread. Time is a parameter.
#pragma once

#include <algorithm>

#include "base/time.h"

namespace qduino::board::linux {

class TimerGravity {
  public:
    /// What takes no longer is a wake-up on any machine.
    static constexpr Nanoseconds kQuick = 50us;
    /// What takes longer is none on any.
    static constexpr Nanoseconds kSlowest = 500us;
    static constexpr int kFirst = 32;  ///< wake-ups, of which the quickest is where it begins

    TimerGravity() = default;
    /// `most`: the lead's own limit.
    explicit TimerGravity(Nanoseconds most) : most_(std::clamp(most, Nanoseconds{0}, kSlowest)) {}

    /// For a loop with this budget: a quarter of it, but what kQuick allows at least. A loop that is not charged has no limit but kSlowest.
    [[nodiscard]] static Nanoseconds lead_limit(Nanoseconds budget, bool charged) {
        return charged ? std::clamp(budget / 4, kQuick, kSlowest) : kSlowest;
    }

    /// About to sleep at `now` until `t`, which is later: when to set the alarm. At least half of the wait is slept.
    [[nodiscard]] Instant alarm_for(Instant t, Instant now) {
        learn();
        alarm_ = t - std::min(lead_, (t - now) / 2);
        return alarm_;
    }
    /// It woke at `now`. Only noted: what follows is due.
    void woke(Instant now) { woke_ = now; }

    [[nodiscard]] Nanoseconds lead() const { return lead_; }
    /// What takes longer teaches nothing, for now.
    [[nodiscard]] Nanoseconds limit() const { return std::clamp(3 * floor_, kQuick, kSlowest); }

  private:
    void learn() {
        const Nanoseconds took = woke_ - alarm_;
        woke_ = kEpoch;
        if (took <= Nanoseconds{0}) return;
        if (seen_ < kFirst) {
            floor_ = std::min(floor_, took);
            // No further at once: all of them may have been behind another loop. It climbs there if they were not.
            if (++seen_ == kFirst) lead_ = std::min({floor_, kQuick, most_});
            return;
        }
        const Nanoseconds most = std::min(limit(), most_);
        if (took <= limit())
            lead_ = std::clamp(lead_ + (took < lead_ ? -7 * kStep : kStep), Nanoseconds{0}, most);
        floor_ = std::clamp(floor_ + (took < floor_ ? -31 * kStep : kStep), Nanoseconds{0}, kSlowest);
    }

    static constexpr Nanoseconds kStep = 50ns;

    Instant alarm_{};
    Instant woke_ = kEpoch;
    Nanoseconds most_ = kSlowest;
    Nanoseconds lead_{0};
    Nanoseconds floor_ = kSlowest;
    int seen_ = 0;
};

}  // namespace qduino::board::linux
