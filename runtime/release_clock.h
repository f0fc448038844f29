// When a loop's next release is: nominal instants that do not drift, and what an overrun does to
// them.
//
//   release k is due at origin + k·period                        ▮ release   █ body   ○ missed
//
//   on time    ▮███·······▮███·······▮███·······▮
//   skip       ▮████████████████·····▮███·······▮       the release due meanwhile (○) is dropped
//                         ○
//   catch_up   ▮████████████████▮██████▮██▮·····▮       it runs at once, late, until on time again
//
// The next release is computed from the nominal start of this one, never from when it really
// started: lateness does not add up. A release is an overrun when it ends after (not at) the
// instant at which the next is due.
#pragma once

#include <cstdint>

#include "base/contract.h"
#include "base/time.h"
#include "runtime/sketch.h"

namespace qduino::runtime {

struct Release {
    Instant nominal;  ///< when it is due; in the past only under catch_up
    /// How long after this one was due the one before it ended; 0: no overrun.
    Nanoseconds lateness{};
    std::int64_t dropped = 0;  ///< releases that will not be run
    [[nodiscard]] bool overrun() const { return lateness > Nanoseconds{0}; }
};

class ReleaseClock {
  public:
    ReleaseClock() = default;  ///< for containers only: assign before use
    /// Release 0 is due at `origin`; a loop whose thread comes up only at `now` begins with the
    /// last one due by then.
    ReleaseClock(Instant origin, Nanoseconds period, Instant now) : origin_(origin), period_(period) {
        QDUINO_EXPECT(period > Nanoseconds{0});
        if (now > origin) index_ = (now - origin) / period;
    }

    /// Nominal start of the present release.
    [[nodiscard]] Instant nominal() const { return origin_ + index_ * period_; }

    /// The present release ended at `now`; advances to the next and returns it.
    Release next(Instant now, OverrunPolicy policy) {
        ++index_;
        Release release{.nominal = nominal(), .lateness = Nanoseconds{0}, .dropped = 0};
        if (now <= release.nominal) return release;
        release.lateness = now - release.nominal;
        if (policy == OverrunPolicy::catch_up) return release;
        release.dropped = (release.lateness + period_ - Nanoseconds{1}) / period_;
        index_ += release.dropped;
        release.nominal = nominal();
        return release;
    }

  private:
    Instant origin_ = kEpoch;
    Nanoseconds period_{1};
    std::int64_t index_ = 0;
};

}  // namespace qduino::runtime
