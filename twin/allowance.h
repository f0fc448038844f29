// How far a right motor may be from the asked path: behind the filters that were asked for, and
// where it turns back.
//
// Both only grow: what has been asked for once may still be in the motion.
#pragma once

#include <algorithm>
#include <array>

#include "twin/compensation.h"
#include "twin/motor_space.h"
#include "twin/turn.h"

namespace qduino::twin {

class Allowance {
  public:
    /// So much of the general limit is for what a motor leaves out where it turns back; more widens
    /// it.
    static constexpr double kTurnSteps = 1.0;

    /// `by` is in force from here on.
    void widen_reach(const MotorSpace& space, const Compensation& by) {
        reach_mm_.widen(by.reach(space.machine()));
        const Position reach = space.gantry().reach_of(reach_mm_.mm);
        for (std::size_t axis = 0; axis < kAxisCount; ++axis)
            reach_steps_[axis] = reach[axis] * space.steps_per_mm(axis);
        // Z has no shaper: it is where the plan is.
        const Position plan = space.gantry().reach_of({reach_mm_.mm[0], reach_mm_.mm[1], 0, 0});
        for (std::size_t axis = 0; axis < kSlideCount; ++axis)
            plan_steps_[axis] = plan[axis] * space.steps_per_mm(axis);
        sum_up();
    }
    /// The way leads to `nozzle`.
    void widen_turn(const MotorSpace& space, const Position& nozzle) {
        for (std::size_t axis = 0; axis < kSlideCount; ++axis) {
            const double rate = space.gantry().rate_of(axis, nozzle);
            turn_mm_[axis] = std::max(turn_mm_[axis], left_out_at_turn_mm(space.machine(), axis, rate));
            turn_steps_[axis] = turn_mm_[axis] * space.steps_per_mm(axis);
        }
        sum_up();
    }

    /// A shaper has been asked for.
    [[nodiscard]] bool shaped() const { return reach_steps_[0] > 0; }
    [[nodiscard]] const Reach& reach_mm() const { return reach_mm_; }
    [[nodiscard]] double extruder_reach_steps() const { return reach_steps_[kExtruder]; }
    [[nodiscard]] const Position& turn_mm() const { return turn_mm_; }
    [[nodiscard]] double turn_steps(std::size_t slide) const { return turn_steps_[slide]; }
    /// How much further a slide may be left behind than the general limit.
    [[nodiscard]] double slack_steps(std::size_t slide) const { return slack_steps_[slide]; }

  private:
    using Slides = std::array<double, kSlideCount>;

    void sum_up() {
        for (std::size_t axis = 0; axis < kSlideCount; ++axis)
            slack_steps_[axis] = plan_steps_[axis] + std::max(turn_steps_[axis] - kTurnSteps, 0.0);
    }

    Reach reach_mm_{};  // of all filters that were asked for so far
    MotorPoint reach_steps_{};
    Slides plan_steps_{};  // how far from the plan filters take a motor
    Position turn_mm_{};   // the largest of the motors on the way so far
    Slides turn_steps_{};
    Slides slack_steps_{};
};

}  // namespace qduino::twin
