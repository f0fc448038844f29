// The limits that shape motion, as they stand for the next move: the machine's own, changed at run time by
// M201 (acceleration per axis), M203 (speed per axis) and M205 (instantaneous speed change).
#pragma once

#include <algorithm>
#include <array>

#include "printer/machine_config.h"

namespace qduino::printer::motion {

/// One number per axis, in the order of printer::Axis: X, Y, Z in mm of machine coordinates, E in mm of
/// filament.
using AxisVector = PerAxis<double>;

constexpr int index_of(Axis axis) { return static_cast<int>(axis); }

struct MotionSettings {
    AxisVector max_speed_mm_s{};          ///< > 0
    AxisVector max_acceleration_mm_s2{};  ///< > 0
    /// Largest speed step of Z and of E where two moves meet; of X and Y see square_corner_speed_mm_s.
    AxisVector instantaneous_speed_mm_s{};
    /// Speed at which a 90° corner is taken at the acceleration that a move asked for. 0: stop at every
    /// corner.
    double square_corner_speed_mm_s = 0;
    AxisVector steps_per_mm{};  ///< > 0
    /// Shortest legal time from one rising edge of a motor's STEP pin to the next.
    double step_interval_s_min = 0;
};

/// Pulse width and low time, and DIR held after one edge and set up before the next: legal even when the
/// motor turns back.
constexpr double step_interval_s(const MachineConfig& config) {
    return config.step_pulse_s + config.step_low_s + 2 * config.direction_setup_s;
}

/// The settings at power-on. Every number is taken as it stands: the reader of the machine file has checked
/// it.
constexpr MotionSettings motion_settings(const MachineConfig& config) {
    MotionSettings settings;
    for (std::size_t i = 0; i < kAxisCount; ++i) {
        settings.max_speed_mm_s[i] = config.axes[i].max_speed_mm_s;
        settings.max_acceleration_mm_s2[i] = config.axes[i].max_acceleration_mm_s2;
        settings.instantaneous_speed_mm_s[i] = config.axes[i].instantaneous_speed_mm_s;
        settings.steps_per_mm[i] = config.axes[i].steps_per_mm;
    }
    settings.square_corner_speed_mm_s =
        std::min(config.axes[0].instantaneous_speed_mm_s, config.axes[1].instantaneous_speed_mm_s);
    settings.step_interval_s_min = step_interval_s(config);
    return settings;
}

}  // namespace qduino::printer::motion
