// Speed along one straight segment: accelerate, cruise, brake, all at the same rate.
//
//   speed                                      area under the curve = length
//     ^        cruise_speed
//     |       ___________________
//     |      /                   \                                                           .
//     |     /                     \ slope -a
//     |    / slope a               \___ exit_speed
//     |   / entry_speed            |
//     +---+--+-----------------+---+-----> time
//         accelerate_s  cruise_s  decelerate_s
//
// It is a triangle when there is no room to reach the cruise speed. Speeds are compared by their
// squares, because v1² = v0² + 2·a·s is linear in the distance s.
//
// Distance to time is solved without cancellation: s = v0·t + ½·a·t² gives t = 2s / (v0 + √(v0² +
// 2as)), exact down to v0 = 0. Braking is solved backwards from the segment's end, with the same
// formula.
#pragma once

#include <algorithm>
#include <cmath>

namespace qduino::printer::motion {

/// Time to cover `distance_mm` from `speed_mm_s` (>= 0) at a constant acceleration > 0.
inline double time_from_speed(double distance_mm, double speed_mm_s, double acceleration_mm_s2) {
    if (distance_mm <= 0) return 0;
    return 2 * distance_mm /
           (speed_mm_s + std::sqrt(speed_mm_s * speed_mm_s + 2 * acceleration_mm_s2 * distance_mm));
}

struct Trapezoid {
    double length_mm = 0;
    double acceleration_mm_s2 = 0;
    double entry_speed_mm_s = 0;
    double cruise_speed_mm_s = 0;
    double exit_speed_mm_s = 0;
    double accelerate_mm = 0;  ///< distance spent accelerating
    double brake_from_mm = 0;  ///< distance at which braking begins
    double accelerate_s = 0;
    double cruise_s = 0;
    double decelerate_s = 0;
    /// Above 0 the ramps are S-curves (s_curve.h), and the two functions of the distance below do
    /// not hold: the solver then reads the ramps (step/motion_track.h).
    double jerk_mm_s3 = 0;

    [[nodiscard]] double duration_s() const { return accelerate_s + cruise_s + decelerate_s; }
    /// Seconds from the start until `distance_mm` (clamped to 0 … length) is covered.
    [[nodiscard]] double time_at(double distance_mm) const {
        if (distance_mm < accelerate_mm)
            return time_from_speed(distance_mm, entry_speed_mm_s, acceleration_mm_s2);
        if (distance_mm <= brake_from_mm)
            return accelerate_s + (distance_mm - accelerate_mm) / cruise_speed_mm_s;
        return duration_s() - time_from_speed(length_mm - distance_mm, exit_speed_mm_s, acceleration_mm_s2);
    }
    /// Distance covered after `time_s` (clamped to 0 … duration).
    [[nodiscard]] double distance_at(double time_s) const {
        const double t = std::clamp(time_s, 0.0, duration_s());
        if (t < accelerate_s) return (entry_speed_mm_s + 0.5 * acceleration_mm_s2 * t) * t;
        if (t <= accelerate_s + cruise_s) return accelerate_mm + cruise_speed_mm_s * (t - accelerate_s);
        const double left = duration_s() - t;
        return length_mm - (exit_speed_mm_s + 0.5 * acceleration_mm_s2 * left) * left;
    }
};

/// The fastest profile over `length_mm` > 0 that enters and leaves at the given speeds and never
/// exceeds `speed_mm_s_max` > 0. The exit must be reachable from the entry: |v1² − v0²| <=
/// 2·a·length, up to rounding.
inline Trapezoid make_trapezoid(double length_mm, double entry_speed_mm_s, double speed_mm_s_max,
                                double exit_speed_mm_s, double acceleration_mm_s2) {
    Trapezoid shape{length_mm, acceleration_mm_s2, entry_speed_mm_s, speed_mm_s_max, exit_speed_mm_s};
    const double entry2 = entry_speed_mm_s * entry_speed_mm_s;
    const double exit2 = exit_speed_mm_s * exit_speed_mm_s;
    // The peak of the triangle.
    const double peak2 = 0.5 * (entry2 + exit2) + acceleration_mm_s2 * length_mm;
    const double cruise2 = std::min(peak2, speed_mm_s_max * speed_mm_s_max);
    if (cruise2 == peak2) shape.cruise_speed_mm_s = std::sqrt(peak2);
    shape.accelerate_mm = std::clamp((cruise2 - entry2) / (2 * acceleration_mm_s2), 0.0, length_mm);
    const double brake_mm = std::clamp((cruise2 - exit2) / (2 * acceleration_mm_s2), 0.0, length_mm);
    shape.brake_from_mm = std::max(length_mm - brake_mm, shape.accelerate_mm);
    shape.accelerate_s = 2 * shape.accelerate_mm / (entry_speed_mm_s + shape.cruise_speed_mm_s);
    shape.cruise_s = (shape.brake_from_mm - shape.accelerate_mm) / shape.cruise_speed_mm_s;
    shape.decelerate_s = 2 * (length_mm - shape.brake_from_mm) / (exit_speed_mm_s + shape.cruise_speed_mm_s);
    return shape;
}

}  // namespace qduino::printer::motion
