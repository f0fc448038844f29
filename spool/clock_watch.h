// Whether the calendar may be believed when something is to be deleted because of its age.
//
// A small computer often has no clock that runs without power: it starts in 1970, and jumps to the
// present when the network tells it. A wrong one may be years ahead. To believe it would delete
// what was printed yesterday. So it is believed only when it
//
//   is not before the day on which this was written,
//   is not far from the last time that the journal knows, and
//   has not jumped against the monotonic clock,
//
// and again once it has gone steadily for a day.
#pragma once

#include <cstdlib>
#include <optional>

#include "base/time.h"
#include "spool/job.h"

namespace qduino::spool {

class ClockWatch {
  public:
    static constexpr UnixSeconds kFirst_s = 1'795'651'200;  ///< 2026-11-26
    static constexpr UnixSeconds kJump_s = 3600;            ///< more than a time zone or a leap
    static constexpr UnixSeconds kAhead_s = 366 * 86400;    ///< of the last time in the journal
    static constexpr Nanoseconds kSteadyFor = std::chrono::hours{24};

    /// `first_s`: no time before it is believed. `last_s`: the newest time in the journal; 0: none.
    explicit ClockWatch(UnixSeconds first_s = kFirst_s, UnixSeconds last_s = 0)
        : first_s_(first_s), known_s_(last_s) {}

    /// Once each tick: the monotonic clock, and the calendar.
    void see(Instant now, UnixSeconds now_s) {
        bool odd = now_s < first_s_;
        if (seen_) {
            const UnixSeconds passed_s = to_ns(now - seen_->first) / 1'000'000'000;
            odd = odd || std::abs(now_s - seen_->second - passed_s) > kJump_s;
        } else {
            since_ = now - kSteadyFor;
            odd = odd || (known_s_ > 0 && (now_s > known_s_ + kAhead_s || now_s < known_s_ - kJump_s));
        }
        if (odd) since_ = now;
        seen_ = {now, now_s};
    }
    [[nodiscard]] bool believed() const { return seen_ && seen_->first - since_ >= kSteadyFor; }
    [[nodiscard]] UnixSeconds first_s() const { return first_s_; }

  private:
    UnixSeconds first_s_, known_s_;
    std::optional<std::pair<Instant, UnixSeconds>> seen_;
    Instant since_{};  // steady
};

}  // namespace qduino::spool
