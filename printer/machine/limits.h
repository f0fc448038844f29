// M201, M203, M204 and M205 on the limits in force, for the machine and for the estimate of a job.
#pragma once

#include <algorithm>
#include <cmath>

#include "printer/gcode/actions.h"
#include "printer/motion/settings.h"

namespace qduino::printer::machine {

/// mm/s² along the path of a move, as M204 sets them.
struct Accelerations {
    double print = 0;
    double travel = 0;
    double filament = 0;

    [[nodiscard]] double of(gcode::MoveKind kind) const {
        if (kind == gcode::MoveKind::travel) return travel;
        return kind == gcode::MoveKind::print ? print : filament;
    }
};

/// Those at power-on.
constexpr Accelerations accelerations_of(const MachineConfig& config) {
    return {config.default_acceleration.value(), config.travel_acceleration.value(),
            config.default_acceleration.value()};
}

/// What `change` gives, into both.
inline void apply(const gcode::LimitChange& change, motion::MotionSettings& settings,
                  Accelerations& accelerations) {
    for (std::size_t i = 0; i < kAxisCount; ++i) {
        if (change.axis_acceleration[i]) settings.max_acceleration[i] = *change.axis_acceleration[i];
        if (change.axis_speed[i]) settings.max_speed[i] = *change.axis_speed[i];
        if (change.axis_instantaneous_speed[i]) {
            settings.instantaneous_speed[i] = *change.axis_instantaneous_speed[i];
        }
    }
    settings.square_corner_speed =
        std::min(settings.instantaneous_speed[Axis::x], settings.instantaneous_speed[Axis::y]);
    if (change.print_acceleration) accelerations.print = change.print_acceleration->value();
    if (change.travel_acceleration) accelerations.travel = change.travel_acceleration->value();
    if (change.filament_acceleration) accelerations.filament = change.filament_acceleration->value();
    if (change.junction_deviation) {
        // δ back to the speed of a square corner (junction.h), at the acceleration now in force.
        settings.square_corner_speed = MillimetresPerSecond{
            std::sqrt(change.junction_deviation->value() * accelerations.print / (std::sqrt(2.0) - 1))};
    }
}

}  // namespace qduino::printer::machine
