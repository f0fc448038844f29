// The limits on motion, as they stand for the next move: the machine's own, changed at run time by
// M201 (acceleration per axis), M203 (speed per axis) and M205 (instantaneous speed change).
#pragma once

#include <algorithm>
#include <array>

#include "printer/kinematics.h"
#include "printer/machine_config.h"

namespace qduino::printer::motion {

/// One number per axis, in the order of printer::Axis: X, Y, Z in mm of machine coordinates, E in
/// mm of filament.
using AxisVector = AxisValues;

/// What is done to the planned motion on its way to the motors. A change needs a standstill,
/// because the steps of both would overlap (step/path_solver.h).
struct MotionFilters {
    std::array<ShaperConfig, 2> shapers{};  ///< X, Y
    /// Over which the filament's way is smoothed; 0: E is as planned, without pressure advance.
    Seconds smooth_time{};

    [[nodiscard]] constexpr bool active() const {
        return shapers[0].active() || shapers[1].active() || smooth_time > Seconds{0};
    }
    friend constexpr bool operator==(const MotionFilters&, const MotionFilters&) = default;
};

struct MotionSettings {
    Kinematics kinematics;
    PerAxis<MillimetresPerSecond> max_speed{};          ///< > 0; of the axis, and of its motor
    PerAxis<MillimetresPerSecond2> max_acceleration{};  ///< > 0; likewise
    /// Largest speed step of Z and of E where two moves meet; of X and Y see square_corner_speed.
    PerAxis<MillimetresPerSecond> instantaneous_speed{};
    /// Speed at which a 90° corner is taken at the acceleration that a move asked for. 0: stop at
    /// every corner.
    MillimetresPerSecond square_corner_speed;
    PerAxis<double> steps_per_mm{};  ///< > 0; of a motor
    Nanoseconds step_interval_min{};
    Nanoseconds reversal_gap{};  ///< steps there and back nearer than this are left out
    double jerk_mm_s3 = 0;       ///< along the path; 0: unlimited
    Seconds pressure_advance{};  ///< of the moves appended from now on
    MotionFilters filters{};     ///< in force at the start
};

/// The settings at power-on. Every number is taken as it stands: the reader of the machine file has
/// checked it.
inline MotionSettings motion_settings(const MachineConfig& config) {
    MotionSettings settings;
    settings.kinematics = Kinematics{config};
    for (std::size_t i = 0; i < kAxisCount; ++i) {
        settings.max_speed[i] = config.axes[i].max_speed;
        settings.max_acceleration[i] = config.axes[i].max_acceleration;
        settings.instantaneous_speed[i] = config.axes[i].instantaneous_speed;
        settings.steps_per_mm[i] = config.axes[i].steps_per_mm;
    }
    settings.square_corner_speed =
        std::min(config.axes[Axis::x].instantaneous_speed, config.axes[Axis::y].instantaneous_speed);
    settings.step_interval_min = step_interval(config);
    settings.reversal_gap = std::max(config.reversal_gap, settings.step_interval_min);
    settings.jerk_mm_s3 = config.jerk_mm_s3;
    settings.pressure_advance = config.pressure_advance.advance;
    for (const Axis axis : {Axis::x, Axis::y}) {
        const ShaperConfig& shaper = config.axes[axis].shaper;
        if (shaper.active()) settings.filters.shapers[static_cast<std::size_t>(axis)] = shaper;
    }
    if (config.pressure_advance.advance > Seconds{0})
        settings.filters.smooth_time = config.pressure_advance.smooth_time;
    return settings;
}

}  // namespace qduino::printer::motion
