#include "printer/motion/junction.h"

#include <algorithm>
#include <cmath>

namespace qduino::printer::motion {
namespace {

constexpr double squared(double x) { return x * x; }

/// s² and c² of the corner (junction.h): in space, or along E for two E-only moves.
struct HalfAngle {
    double sin2 = 0;
    double cos2 = 0;
};
HalfAngle half_angle(const MoveGeometry& before, const MoveGeometry& after) {
    HalfAngle half;
    // X, Y and Z, or E alone.
    const std::size_t first = after.extrude_only ? 3 : 0;
    const std::size_t last = after.extrude_only ? 3 : 2;
    for (std::size_t i = first; i <= last; ++i) {
        half.sin2 += 0.25 * squared(before.direction[i] + after.direction[i]);
        half.cos2 += 0.25 * squared(before.direction[i] - after.direction[i]);
    }
    return half;
}

}  // namespace

double junction_speed_squared(const MoveGeometry& before, const MoveGeometry& after,
                              const PerAxis<MillimetresPerSecond>& instantaneous_speed) {
    if (before.extrude_only != after.extrude_only) return 0;
    double limit2 = squared(std::min(before.speed_mm_s, after.speed_mm_s));
    const HalfAngle half = half_angle(before, after);
    if (half.cos2 > 0) {
        const double sine = std::sqrt(half.sin2);
        const double cosine = std::sqrt(half.cos2);
        const double deviation = std::min(before.acceleration_mm_s2 * before.deviation_mm,
                                          after.acceleration_mm_s2 * after.deviation_mm);
        limit2 = std::min(limit2, deviation * sine * (1 + sine) / half.cos2);
        const double reach = std::min(before.acceleration_mm_s2 * before.length_mm,
                                      after.acceleration_mm_s2 * after.length_mm);
        limit2 = std::min(limit2, 0.5 * reach * sine / cosine);
    }
    for (const Axis axis : {Axis::z, Axis::e}) {
        const double change = std::abs(after.direction[axis] - before.direction[axis]);
        if (change > 0) limit2 = std::min(limit2, squared(instantaneous_speed[axis].value() / change));
    }
    return limit2;
}

}  // namespace qduino::printer::motion
