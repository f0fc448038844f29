// How far behind a motor may stay where it turns back: what a firmware leaves out there.
//
// A motor that goes beyond a half-step and comes back at once would step there and back, and move
// nothing but the rotor. Firmware leaves out such a pair nearer than kPair, with all that
// lies within it (0.75 ms: Klipper's step compression). Until it is back, the motor lags by half a
// step and by h:
//
//   way  ^        .·.                 h = v1·t1 = v2·t2,   t1 + t2 < kPair
//        |  - - -/- -\- - half-step
//        |     ./     \.              h < kPair · v1·v2/(v1 + v2) <= kPair · (v1 + v2)/4
//             t1   t2  ──► time
//
// v1 + v2 is the change of the motor's velocity meanwhile: at most its rate (its way for a
// millimetre of the nozzle's) times the nozzle's change. At a corner by the angle φ that is
// 2·v·sin(φ/2). Junction deviation bounds v² by c²·(√2 − 1)·k/(1 − k), k = cos(φ/2), c the speed
// through a square corner (junction.h of grbl and Klipper alike). So the change is
//
//   2·c·√((√2 − 1)·k·(1 + k)) <= 2·c·√(2·(√2 − 1)) = 1.82·c
//
// Several corners within kPair are joined by shorter moves than that. Each of them bounds changes
// at its ends by a·t (the bound v² <= ½·L·a·cot(φ/2) of short moves), a the acceleration: 2·a·kPair
// all together. Acceleration along the way adds a·kPair.
#pragma once

#include <algorithm>

#include "twin/gantry.h"
#include "twin/machine.h"

namespace qduino::twin {

/// In mm of `motor`, which goes `rate` mm for one of the nozzle; above half a step.
[[nodiscard]] inline double left_out_at_turn_mm(const Machine& machine, std::size_t motor, double rate) {
    constexpr double kPair_s = 0.75e-3;
    constexpr double kCornerChange = 1.82;
    const bool alone = machine.gantry != GantryType::delta && motor == 2;
    double corner_mm_s = machine.axes[2].corner_mm_s / kCornerChange;  // it is the change itself
    double acceleration_mm_s2 = machine.axes[2].top_acceleration_mm_s2;
    for (std::size_t axis = 0; axis < 2 && !alone; ++axis) {
        corner_mm_s = std::max(axis == 0 ? 0 : corner_mm_s, machine.axes[axis].corner_mm_s);
        acceleration_mm_s2 = std::max(acceleration_mm_s2, machine.axes[axis].top_acceleration_mm_s2);
    }
    const double by_acceleration = acceleration_mm_s2 * kPair_s;
    const double change_mm_s = std::max(kCornerChange * corner_mm_s, 2 * by_acceleration) + by_acceleration;
    return kPair_s * rate * change_mm_s / 4;
}

}  // namespace qduino::twin
