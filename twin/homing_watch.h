// Homing, seen from the pins: when has an axis found its switch?
//
//   switch  ____________┌─────┐______________________┌──────────────   position := home here
//   steps   ||||||||||||  ...  |||||||||  ...  | | | |     (still)
//           fast approach      retreat         slow approach   └─ >= 20 ms ─┘
//                        press 1                     press 2
//
// A slide is home when its switch has closed twice, is closed, and the slide has stood still for
// kRest. A switch that was closed from the start counts as the first press: the firmware then
// begins with the retreat. Rests between the strokes may have any length. A slide is also home when
// another one of the same G28 begins to move by itself after the first one's second press.
//
// Where two belts move two slides (CoreXY), one belt's step comes before the other's, and the slide
// that does not move leaves its switch by half a step for that long. A switch that has been open
// for less than kFlicker has not been left.
//
// Invariant: a slide never becomes home before its second press.
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
    static constexpr Nanoseconds kFlicker{20'000'000};

    /// A G28 of the axes in `mask` begins; `pressed` is each switch just before its first step.
    void begin(Instant now, std::uint8_t mask, const std::array<bool, kSlideCount>& pressed) {
        pending_ = mask;
        pressed_ = pressed;
        stepped_at_.fill(now);
        std::ranges::copy(pressed, presses_.begin());
    }
    [[nodiscard]] bool active() const { return pending_ != 0; }
    /// Bit per slide that is not home yet.
    [[nodiscard]] std::uint8_t pending() const { return pending_; }

    void on_endstop(Instant at, int axis, bool pressed) {
        pressed_[axis] = pressed;
        if (!pressed) opened_at_[axis] = at;
        if (pressed && (presses_[axis] == 0 || at - opened_at_[axis] >= kFlicker)) ++presses_[axis];
    }

    /// Call before a step at `now` that moves the slides `moved`, a mask (0: no step, only time has
    /// passed). Returns those that are home by then; they are no longer pending.
    [[nodiscard]] std::uint8_t settle(Instant now, std::uint8_t moved) {
        std::uint8_t home = 0;
        for (std::size_t slide = 0; slide < kSlideCount; ++slide) {
            const auto bit = static_cast<std::uint8_t>(1u << slide);
            if ((pending_ & bit) == 0 || presses_[slide] < 2 || !pressed_[slide]) continue;
            const bool rested = now - stepped_at_[slide] >= kRest;
            const bool next_one_moves = (moved & bit) == 0 && (moved & pending_) != 0;
            if (rested || next_one_moves) home = static_cast<std::uint8_t>(home | bit);
        }
        pending_ = static_cast<std::uint8_t>(pending_ & ~home);
        for (std::size_t slide = 0; slide < kSlideCount; ++slide)
            if ((moved >> slide & 1u) != 0) stepped_at_[slide] = now;
        return home;
    }

  private:
    std::uint8_t pending_ = 0;
    std::array<int, kSlideCount> presses_{};
    std::array<bool, kSlideCount> pressed_{};
    std::array<Instant, kSlideCount> stepped_at_{};
    std::array<Instant, kSlideCount> opened_at_{};
};

}  // namespace qduino::twin
