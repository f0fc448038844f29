// One straight move as the G-code asks for it, before any limit is applied.
#pragma once

#include <array>

#include "printer/motion/settings.h"

namespace qduino::printer::motion {

/// A move starts where the one before it ends: the planner knows that place.
struct Move {
    /// X, Y, Z in machine coordinates, inside the bounds (the caller has checked).
    std::array<double, 3> end_mm{};
    double filament_mm = 0;  ///< how far E advances; negative retracts
    /// Along X, Y, Z, or along E when nothing else moves (Marlin's meaning of F, in mm/s). Raised
    /// to kSpeedMin.
    double speed_mm_s = 0;
    double acceleration_mm_s2 = 0;  ///< > 0; along the same path (M204 P, R or T)
};

/// A feed rate of 0 must not hang the printer.
inline constexpr double kSpeedMin_mm_s = 0.01;
/// A shorter move is left to the next one, so that nothing is lost.
inline constexpr double kLengthMin_mm = 1e-9;

}  // namespace qduino::printer::motion
