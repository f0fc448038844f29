// Homing, seen from the pins: when has an axis found its switch?
//
//   switch  ____________┌─────┐______________________┌──────────────   position := home here
//   steps   ||||||||||||  ...  |||||||||  ...  | | | |     (still)
//           fast approach      retreat         slow approach   └─ >= 20 ms ─┘
//                        press 1                     press 2
//
// An axis is home when its switch has closed twice, is closed, and the axis has stood still for
// kRest. A switch that was closed from the start counts as the first press: the firmware then
// begins with the retreat. Rests between the strokes may have any length. An axis is also home when
// another axis of the same G28 begins to move after the first one's second press.
//
// Invariant: an axis never becomes home before its second press.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "base/time.h"
#include "twin/machine.h"

namespace qduino::twin {

class HomingWatch {
  public:
    static constexpr Nanoseconds kRest{20'000'000};

    /// A G28 of the axes in `mask` begins; `pressed` is each switch just before its first step.
    void begin(Instant now, std::uint8_t mask, const std::array<bool, kSlideCount>& pressed) {
        pending_ = mask;
        pressed_ = pressed;
        stepped_at_.fill(now);
        std::ranges::copy(pressed, presses_.begin());
    }
    [[nodiscard]] bool active() const { return pending_ != 0; }
    [[nodiscard]] bool pending(int axis) const { return (pending_ >> axis & 1) != 0; }

    void on_endstop(int axis, bool pressed) {
        pressed_[axis] = pressed;
        if (pressed) ++presses_[axis];
    }

    /// Call before a step of `axis` is counted at `now` (−1: no step, only time has passed).
    /// Returns the axes that are home by then, as a mask; they are no longer pending.
    [[nodiscard]] std::uint8_t settle(Instant now, int axis) {
        std::uint8_t home = 0;
        for (int other = 0; other < kSlideCount; ++other) {
            if (!pending(other) || presses_[other] < 2 || !pressed_[other]) continue;
            const bool rested = now - stepped_at_[other] >= kRest;
            const bool next_one_moves = axis >= 0 && axis != other && axis < kSlideCount && pending(axis);
            if (rested || next_one_moves) home = static_cast<std::uint8_t>(home | 1u << other);
        }
        pending_ = static_cast<std::uint8_t>(pending_ & ~home);
        if (axis >= 0 && axis < kSlideCount) stepped_at_[axis] = now;
        return home;
    }

  private:
    std::uint8_t pending_ = 0;
    std::array<int, kSlideCount> presses_{};
    std::array<bool, kSlideCount> pressed_{};
    std::array<Instant, kSlideCount> stepped_at_{};
};

}  // namespace qduino::twin
