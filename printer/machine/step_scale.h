// Where the machine is, by its step counts: steps per millimetre, and the count at which each axis
// has its zero.
//
// Homing moves the zero of X, Y and Z. A pause moves E's when filament was pushed meanwhile.
// Loop 1 only.
#pragma once

#include <cmath>
#include <cstdint>

#include "printer/machine_config.h"
#include "printer/motion/kinematics.h"
#include "printer/motion/settings.h"

namespace qduino::printer::machine {

/// One count per axis, as pulses went out.
using StepCounts = PerAxis<std::int64_t>;

class StepScale {
  public:
    /// At counts of 0 each of X, Y, Z is taken to stand at its home position.
    explicit StepScale(const MachineConfig& config) {
        for (std::size_t i = 0; i < kAxisCount; ++i) steps_per_mm_[i] = config.axes[i].steps_per_mm;
        for (const Axis axis : {Axis::x, Axis::y, Axis::z})
            origin_[axis] = -steps_to(axis, config.axes[axis].home_position.value());
    }

    /// The counts at machine position 0.
    [[nodiscard]] const StepCounts& origin() const { return origin_; }
    [[nodiscard]] motion::AxisVector position_of(const StepCounts& steps) const {
        motion::AxisVector motors_mm{};
        for (std::size_t i = 0; i < kAxisCount; ++i)
            motors_mm[i] = static_cast<double>(steps[i] - origin_[i]) / steps_per_mm_[i];
        return motion::tool_from_motors(motors_mm);
    }
    [[nodiscard]] double length_of(Axis axis, std::int64_t steps) const {
        return static_cast<double>(std::abs(steps)) / steps_per_mm_[axis];
    }

    /// By definition `axis` stands at `position_mm` when its count is `steps`.
    void define(Axis axis, std::int64_t steps, double position_mm) {
        origin_[axis] = steps - steps_to(axis, position_mm);
    }
    /// `steps` of `axis` went out beside the path: they do not count.
    void skip(Axis axis, std::int64_t steps) { origin_[axis] += steps; }

  private:
    [[nodiscard]] std::int64_t steps_to(Axis axis, double mm) const {
        return std::llround(mm * steps_per_mm_[axis]);
    }

    motion::AxisVector steps_per_mm_{};
    StepCounts origin_{};
};

}  // namespace qduino::printer::machine
