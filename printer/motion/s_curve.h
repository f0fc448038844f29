// Speeds that change with a bounded jerk: the S-curve profile of a move.
//
//   acceleration        a_______                     jerk_s, flat_s, jerk_s: it grows, stays, and
//     ^                /        \                    falls to 0 again
//     |               /          \                                                          .
//     +--------------'------------'----> time        the speed follows an S: half of its change
//     |              jerk  flat  jerk                lies on each side of the middle, so the way is
//                                                    (v0 + v1) / 2 · duration
//
// A change of speed of Δv at an acceleration of at most a and a jerk of at most j takes
//
//      Δv >= a²/j:  Δv/a + a/j          else  2·√(Δv/j): a is never reached
//
// (Biagiotti and Melchiorri, "Trajectory Planning for Automatic Machines and Robots", 2008, chapter
// 3.)
//
// Each ramp of a move is one such change, so the acceleration is 0 where moves meet. A ramp over
// many short moves therefore takes a little longer than over one long move. At corners the
// direction jumps as it does with a trapezoid.
#pragma once

#include <algorithm>
#include <cmath>

#include "printer/motion/trapezoid.h"

namespace qduino::printer::motion {

struct SpeedRamp {
    double jerk_s = 0;  ///< the acceleration grows for so long, and falls
    double flat_s = 0;  ///< … and stays

    [[nodiscard]] double duration_s() const { return 2 * jerk_s + flat_s; }
};

/// For a change of `change_mm_s` >= 0.
inline SpeedRamp speed_ramp(double change_mm_s, double acceleration_mm_s2, double jerk_mm_s3) {
    const double full_s = acceleration_mm_s2 / jerk_mm_s3;
    if (change_mm_s >= acceleration_mm_s2 * full_s)
        return {full_s, change_mm_s / acceleration_mm_s2 - full_s};
    return {std::sqrt(change_mm_s / jerk_mm_s3), 0};
}

/// The way on which the speed changes from one to the other.
inline double ramp_mm(double from_mm_s, double to_mm_s, double acceleration_mm_s2, double jerk_mm_s3) {
    return 0.5 * (from_mm_s + to_mm_s) *
           speed_ramp(std::abs(to_mm_s - from_mm_s), acceleration_mm_s2, jerk_mm_s3).duration_s();
}

/// The highest speed that can be reached from `speed_mm_s` on `length_mm`: the inverse of
/// ramp_mm().
inline double speed_after_ramp(double speed_mm_s, double length_mm, double acceleration_mm_s2,
                               double jerk_mm_s3) {
    // With full acceleration: v1² + b·v1 = v0² − b·v0 + 2·a·L, where b = a²/j.
    const double b = acceleration_mm_s2 * acceleration_mm_s2 / jerk_mm_s3;
    const double root = speed_mm_s - 0.5 * b;
    const double full = std::sqrt(root * root + 2 * acceleration_mm_s2 * length_mm) - 0.5 * b;
    if (full - speed_mm_s >= b) return full;
    // Without, u = √Δv: u³ + 2·v0·u = L·√j. Cardano, in a form that does not cancel.
    const double p = 2 * speed_mm_s / 3;
    const double c = length_mm * std::sqrt(jerk_mm_s3);
    if (c <= 0) return speed_mm_s;
    const double s = std::cbrt(0.5 * c + std::sqrt(0.25 * c * c + p * p * p));
    const double u = c / (s * s + p + p * p / (s * s));
    return speed_mm_s + u * u;
}

/// As make_trapezoid(), with the jerk bounded. The exit must be reachable from the entry
/// (speed_after_ramp()), up to rounding.
inline Trapezoid make_s_curve(double length_mm, double entry_speed_mm_s, double speed_mm_s_max,
                              double exit_speed_mm_s, double acceleration_mm_s2, double jerk_mm_s3) {
    const auto way_mm = [&](double speed) {
        return ramp_mm(entry_speed_mm_s, speed, acceleration_mm_s2, jerk_mm_s3) +
               ramp_mm(speed, exit_speed_mm_s, acceleration_mm_s2, jerk_mm_s3);
    };
    double low = std::max(entry_speed_mm_s, exit_speed_mm_s);
    double high = std::max(low, speed_mm_s_max);
    if (way_mm(high) <= length_mm) {
        low = high;
    } else {
        for (int i = 0; i < 60 && low < high; ++i) {
            const double middle = 0.5 * (low + high);
            (way_mm(middle) <= length_mm ? low : high) = middle;
        }
    }
    Trapezoid shape{length_mm, acceleration_mm_s2, entry_speed_mm_s, low, exit_speed_mm_s};
    shape.jerk_mm_s3 = jerk_mm_s3;
    const auto seconds = [&](double change) {
        return speed_ramp(change, acceleration_mm_s2, jerk_mm_s3).duration_s();
    };
    shape.accelerate_s = seconds(low - entry_speed_mm_s);
    shape.decelerate_s = seconds(low - exit_speed_mm_s);
    shape.accelerate_mm = std::min(0.5 * (entry_speed_mm_s + low) * shape.accelerate_s, length_mm);
    const double brake_mm = 0.5 * (low + exit_speed_mm_s) * shape.decelerate_s;
    shape.brake_from_mm = std::max(length_mm - brake_mm, shape.accelerate_mm);
    shape.cruise_s = low > 0 ? (shape.brake_from_mm - shape.accelerate_mm) / low : 0;
    return shape;
}

}  // namespace qduino::printer::motion
