// The limits on motion, as they stand for the next move: the machine's own, changed at run time by
// M201 (acceleration per axis), M203 (speed per axis) and M205 (instantaneous speed change).
#pragma once

#include <algorithm>

#include "printer/machine_config.h"

namespace qduino::printer::motion {

/// One number per axis, in the order of printer::Axis: X, Y, Z in mm of machine coordinates, E in
/// mm of filament.
using AxisVector = PerAxis<double>;

struct MotionSettings {
    PerAxis<MillimetresPerSecond> max_speed{};          ///< > 0
    PerAxis<MillimetresPerSecond2> max_acceleration{};  ///< > 0
    /// Largest speed step of Z and of E where two moves meet; of X and Y see square_corner_speed.
    PerAxis<MillimetresPerSecond> instantaneous_speed{};
    /// Speed at which a 90° corner is taken at the acceleration that a move asked for. 0: stop at
    /// every corner.
    MillimetresPerSecond square_corner_speed;
    PerAxis<double> steps_per_mm{};  ///< > 0
    Nanoseconds step_interval_min{};
};

/// The settings at power-on. Every number is taken as it stands: the reader of the machine file has
/// checked it.
constexpr MotionSettings motion_settings(const MachineConfig& config) {
    MotionSettings settings;
    for (std::size_t i = 0; i < kAxisCount; ++i) {
        settings.max_speed[i] = config.axes[i].max_speed;
        settings.max_acceleration[i] = config.axes[i].max_acceleration;
        settings.instantaneous_speed[i] = config.axes[i].instantaneous_speed;
        settings.steps_per_mm[i] = config.axes[i].steps_per_mm;
    }
    settings.square_corner_speed =
        std::min(config.axes[Axis::x].instantaneous_speed, config.axes[Axis::y].instantaneous_speed);
    settings.step_interval_min = step_interval(config);
    return settings;
}

}  // namespace qduino::printer::motion
