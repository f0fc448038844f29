// What the comparison of a job's built path with its asked one has found.
#pragma once

#include <array>
#include <cstdint>

#include "twin/machine.h"

namespace qduino::twin {

/// The movements of one motor during a job, and the final place and homing of the axis of its
/// number. Deviations and positions in mm.
struct AxisFindings {
    std::uint64_t steps = 0;            ///< microsteps moved, either way, homing included
    std::uint64_t unexplained = 0;      ///< steps that the path does not ask for
    double path_deviation_mm_max = 0;   ///< from the straight pieces
    std::uint64_t worst_line = 0;       ///< line of the G-code at the largest deviation
    double curve_deviation_mm_max = 0;  ///< from the arcs and splines
    std::uint64_t worst_curve_line = 0;
    double final_asked_mm = 0;
    double final_built_mm = 0;
    bool final_exact = false;  ///< the motor is at the whole step nearest to asked
    double reach_mm = 0;       ///< what the filters that were asked for may add to the deviations
    double turn_mm = 0;        ///< what the motor may lag behind where it turns back (turn.h)
    bool homed = false;
    /// Distance from where homing stopped to where the switch truly closes (set by Job).
    double homing_error_mm = 0;
};

struct Findings {
    bool path_consumed = false;  ///< every asked piece was passed
    std::array<AxisFindings, kAxisCount> axes{};
    double filament_asked_mm = 0;  ///< net: retractions and their returns cancel
    double filament_built_mm = 0;
    double filament_asked_pushed_mm = 0;  ///< forward movements alone
    double filament_built_pushed_mm = 0;
    /// The share that was built of the lead that pressure advance asks for; over so many
    /// stretches.
    double advance_gain = 1;
    std::uint64_t advance_stretches = 0;
    std::uint64_t line = 0;  ///< line that was reached
    /// How often the head left the path at a rest and came back to the same step.
    std::uint64_t excursions = 0;
    bool away = false;            ///< it left the path for good …
    std::uint64_t left_line = 0;  ///< … at this line of the G-code
    /// … and at the rest nearest to where it left, it stood this many microsteps beside (0 0 0: it
    /// never came near)
    std::array<std::int64_t, kSlideCount> beside_steps{};
};

}  // namespace qduino::twin
