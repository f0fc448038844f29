// Sets a loop's alarm early, by the time from the timer's interrupt to the loop's first
// instruction.
//
//                    due                                                 due
//   plain             ▼ timer                    with gravity   timer     ▼
//                     ├─── wake-up ───┤ body                    ├─── wake-up ───┤ body
//                                                               ├ wake-up ┤spin┤ body  1 of 8
//
// A wake-up takes 5 to 20 us, nearly always: the interrupt, the way out of an idle core (out of the
// hypervisor, in a virtual machine), the switch. So the alarm can be set earlier by a time that
// nearly every wake-up takes. Xenomai does so with all its timers and calls it the clock's gravity
// (its program `autotune` measures it once). Here each loop learns its own lead while it runs: the
// eighth of its wake-ups that are quickest come early. They spin the rest, a few microseconds,
// charged to the loop's budget. A release may be late, never early: the caller waits for the
// instant itself.
//
// Steps find the eighth: down by 7 after a wake-up that was quicker, up by 1 after one that was
// not. The lead then stands where one wake-up in eight is quicker (the stochastic approximation of
// a quantile: Robbins and Monro, 1951).
//
// A stall of the host, or a loop of higher priority, must not count as a wake-up. A fixed limit
// fails: some hosts take 69 us for nearly every wake-up. So the limit follows the computer. The
// floor, the quickest thirty-second of all wake-ups (found in the same way), is a wake-up with
// nothing in the way. A wake-up longer than three times the floor, and longer than 50 us, was a
// stall and teaches nothing. So a loop never spins for more than two of the quickest wake-ups,
// unless those are below 17 us each.
//
//   0        floor            lead                        3 x floor
//   ├──────────┼───────────────┼──────────────────────────────┼───────────────
//              │ 1/32 quicker  │ 1/8 quicker                  │ teaches nothing
//
// Hard limits: kSlowest for anything that counts as a wake-up, half of the wait, and `most` for the
// lead. The spin is charged to the loop's budget and must stay a small part of it (lead_limit()).
//
// One thread. Time is a parameter.
#pragma once

#include <algorithm>

#include "base/time.h"

namespace qduino::board::linux {

class TimerGravity {
  public:
    /// Anything up to this is a wake-up on any computer.
    static constexpr Nanoseconds kQuick = 50us;
    /// Anything above this is none on any.
    static constexpr Nanoseconds kSlowest = 500us;
    static constexpr int kFirst = 32;  ///< wake-ups, of which the quickest is where it begins

    TimerGravity() = default;
    /// `most`: the lead's own limit.
    explicit TimerGravity(Nanoseconds most) : most_(std::clamp(most, Nanoseconds{0}, kSlowest)) {}

    /// For a loop with this budget: a quarter of it, but at least what kQuick allows. A loop that
    /// is not charged has no limit but kSlowest.
    [[nodiscard]] static Nanoseconds lead_limit(Nanoseconds budget, bool charged) {
        return charged ? std::clamp(budget / 4, kQuick, kSlowest) : kSlowest;
    }

    /// Call before a sleep from `now` until `t`, which is later. Returns the instant of the alarm.
    /// At least half of the wait is slept.
    [[nodiscard]] Instant alarm_for(Instant t, Instant now) {
        learn();
        alarm_ = t - std::min(lead_, (t - now) / 2);
        return alarm_;
    }
    /// The loop woke at `now`. Only noted: the work that is due comes next.
    void woke(Instant now) { woke_ = now; }

    [[nodiscard]] Nanoseconds lead() const { return lead_; }
    /// A longer wake-up teaches nothing, for now.
    [[nodiscard]] Nanoseconds limit() const { return std::clamp(3 * floor_, kQuick, kSlowest); }

  private:
    void learn() {
        const Nanoseconds took = woke_ - alarm_;
        woke_ = kEpoch;
        if (took <= Nanoseconds{0}) return;
        if (seen_ < kFirst) {
            floor_ = std::min(floor_, took);
            // Not further at once: all the wake-ups may have been behind another loop. The lead
            // climbs there if they were not.
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
