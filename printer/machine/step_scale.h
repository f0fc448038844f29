// Where the machine is, by its step counts: steps per millimetre, and the count at which each motor
// has its zero.
//
// Homing moves the zero of the motors that it moves. A pause moves E's when filament was pushed
// meanwhile. Loop 1 only.
#pragma once

#include <cmath>
#include <cstdint>

#include "printer/gcode/position.h"
#include "printer/kinematics.h"
#include "printer/motion/settings.h"

namespace qduino::printer::machine {

/// One count per motor, as pulses went out.
using StepCounts = PerAxis<std::int64_t>;

class StepScale {
  public:
    /// At counts of 0 each of X, Y, Z is taken to stand at its home position.
    explicit StepScale(const MachineConfig& config) : kinematics_(config) {
        motion::AxisVector home{};
        for (std::size_t i = 0; i < kAxisCount; ++i) steps_per_mm_[i] = config.axes[i].steps_per_mm;
        for (const Axis axis : gcode::kToolAxes) home[axis] = config.axes[axis].home_position.value();
        stand_at(home, {}, 0b0111);
    }

    /// The counts at motor position 0.
    [[nodiscard]] const StepCounts& origin() const { return origin_; }
    [[nodiscard]] motion::AxisVector position_of(const StepCounts& steps) const {
        motion::AxisVector motors_mm{};
        for (std::size_t i = 0; i < kAxisCount; ++i)
            motors_mm[i] = static_cast<double>(steps[i] - origin_[i]) / steps_per_mm_[i];
        return kinematics_.tool_from_motors(motors_mm);
    }
    /// … and exactly where `planned_mm` is, on each axis with a motor of its own that stands at the
    /// step nearest to it. A motor stands on whole steps and a plan does not: what is left of a
    /// step must not be lost when another axis is homed.
    [[nodiscard]] motion::AxisVector position_of(const StepCounts& steps,
                                                 const motion::AxisVector& planned_mm) const {
        motion::AxisVector at_mm = position_of(steps);
        for (std::size_t i = 0; i < kAxisCount; ++i) {
            const auto axis = static_cast<Axis>(i);
            if (kinematics_.motors_of(axis) != motor_bit(axis)) continue;
            if (whole_steps(planned_mm[i] * steps_per_mm_[i]) == steps[i] - origin_[i])
                at_mm[i] = planned_mm[i];
        }
        return at_mm;
    }
    [[nodiscard]] double length_of(Axis motor, std::int64_t steps) const {
        return static_cast<double>(std::abs(steps)) / steps_per_mm_[motor];
    }

    /// By definition each of `axes` stands at its value of `tool_mm` when the counts are `steps`;
    /// the other axes stand where they did. A motor stands on a whole step: of two belts with an
    /// odd number of steps between them, X and Y cannot both, and both belts are half a step off.
    void define(gcode::AxisSet axes, const StepCounts& steps, const motion::AxisVector& tool_mm) {
        motion::AxisVector at_mm = kinematics_.homes_together() ? tool_mm : position_of(steps);
        MotorMask moved = 0;
        for (const Axis axis : gcode::kToolAxes) {
            if (!axes.contains(axis)) continue;
            at_mm[axis] = tool_mm[axis];
            moved |= kinematics_.motors_of(axis);
        }
        stand_at(at_mm, steps, moved);
    }
    /// `steps` of `motor` went out beside the path: they do not count.
    void skip(Axis motor, std::int64_t steps) { origin_[motor] += steps; }

  private:
    void stand_at(const motion::AxisVector& tool_mm, const StepCounts& steps, MotorMask motors) {
        const motion::AxisVector motors_mm = kinematics_.motors_from_tool(tool_mm);
        for (const Axis motor : gcode::kToolAxes)
            if ((motors & motor_bit(motor)) != 0)
                origin_[motor] = steps[motor] - whole_steps(motors_mm[motor] * steps_per_mm_[motor]);
    }
    /// Half a step is rounded up, as the solver does (step/solver.h).
    [[nodiscard]] static std::int64_t whole_steps(double steps) {
        return static_cast<std::int64_t>(std::floor(steps + 0.5));
    }

    Kinematics kinematics_;
    motion::AxisVector steps_per_mm_{};
    StepCounts origin_{};
};

}  // namespace qduino::printer::machine
