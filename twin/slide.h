// A slide: a carriage between two ends of the frame, with a switch near one of them.
//
//   frame |···· ─────────────────────────────────────── ····| frame
//         hard   trigger: the switch closes here, and beyond
//
// Positions are whole steps of the slide's own (gantry.h).
#pragma once

#include <cmath>
#include <cstdint>

#include "base/time.h"
#include "twin/machine.h"

namespace qduino::twin {

class Slide {
  public:
    Slide(const AxisSpec& spec, double steps_per_mm, std::int64_t position)
        : steps_per_mm_(steps_per_mm),
          hard_minimum_(to_steps(spec.hard_minimum_mm)),
          hard_maximum_(to_steps(spec.hard_maximum_mm)),
          trigger_(to_steps(spec.trigger_mm)),
          trigger_at_minimum_(spec.trigger_at_minimum),
          pressed_(closes_at(position)) {}

    [[nodiscard]] bool has_room_at(std::int64_t position) const {
        return position >= hard_minimum_ && position <= hard_maximum_;
    }
    /// After a step to `position`: true when the switch changed with it.
    [[nodiscard]] bool update(Instant now, std::int64_t position) {
        if (closes_at(position) == pressed_) return false;
        pressed_ = !pressed_;
        switched_at_ = now;
        return true;
    }

    [[nodiscard]] bool pressed() const { return pressed_; }
    [[nodiscard]] Instant switched_at() const { return switched_at_; }
    /// Where the switch truly closes.
    [[nodiscard]] std::int64_t trigger() const { return trigger_; }
    [[nodiscard]] double to_mm(std::int64_t steps) const {
        return static_cast<double>(steps) / steps_per_mm_;
    }

  private:
    [[nodiscard]] std::int64_t to_steps(double mm) const {
        return static_cast<std::int64_t>(std::llround(mm * steps_per_mm_));
    }
    [[nodiscard]] bool closes_at(std::int64_t position) const {
        return trigger_at_minimum_ ? position <= trigger_ : position >= trigger_;
    }

    double steps_per_mm_;
    std::int64_t hard_minimum_;
    std::int64_t hard_maximum_;
    std::int64_t trigger_;
    bool trigger_at_minimum_;
    bool pressed_;
    Instant switched_at_ = kEpoch - std::chrono::hours{1};
};

}  // namespace qduino::twin
