#include "printer/gcode/arc.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace qduino::printer::gcode {
namespace {

constexpr double kTwoPi = 2 * std::numbers::pi;

/// In the plane's axes.
struct Centre {
    double first_mm, second_mm;
};

bool is_same_place(double first_mm, double second_mm) {
    return std::abs(first_mm) <= kSamePlaceMm && std::abs(second_mm) <= kSamePlaceMm;
}

/// G2/G3 R: of the two circles of that radius through both ends, the one whose arc in the wanted
/// direction is the shorter (R above 0) or the longer (below 0).
///
///     centre = middle of the chord ± h · (unit normal of the chord), h = √(r² − (chord/2)²)
Result<Centre> centre_by_radius(const Position& from, const Position& to, const ArcGeometry& geometry) {
    const PlaneAxes axes = axes_of(geometry.plane);
    const double first = (to[axes.first] - from[axes.first]).value();
    const double second = (to[axes.second] - from[axes.second]).value();
    const double chord = std::hypot(first, second);
    const double radius = std::abs(geometry.radius_mm);
    if (is_same_place(first, second)) {
        return make_error(ErrorCode::invalid_argument,
                          "an arc with R needs an end that differs from its start");
    }
    if (chord > 2 * radius + kArcRadiusMismatchMm) {
        return make_error(ErrorCode::invalid_argument, "R is too small to reach from the start to the end");
    }
    const double half = std::min(chord / 2, radius);
    double height = std::sqrt(radius * radius - half * half);
    // The normal to the left of the chord holds the centre of a short counterclockwise arc.
    if ((geometry.direction == ArcDirection::clockwise) != (geometry.radius_mm < 0)) height = -height;
    return Centre{from[axes.first].value() + first / 2 - second / chord * height,
                  from[axes.second].value() + second / 2 + first / chord * height};
}

Result<Centre> centre_of(const Position& from, const Position& to, const ArcGeometry& geometry) {
    if (geometry.by_radius) return centre_by_radius(from, to, geometry);
    const PlaneAxes axes = axes_of(geometry.plane);
    return Centre{from[axes.first].value() + geometry.centre_first_mm,
                  from[axes.second].value() + geometry.centre_second_mm};
}

/// Radians from start to end in the arc's direction; a whole turn when both are the same point.
double sweep_of(double angle_from, double angle_to, bool same_point, const ArcGeometry& geometry) {
    const bool counterclockwise = geometry.direction == ArcDirection::counterclockwise;
    double sweep = counterclockwise ? angle_to - angle_from : angle_from - angle_to;
    sweep = std::fmod(sweep, kTwoPi);
    // Ends that differ in radius alone have no sweep: rounding must not make a whole turn of it.
    if (std::abs(sweep) < 1e-9) sweep = 0;
    if (sweep < 0) sweep += kTwoPi;
    if (same_point) sweep = geometry.turns > 0 ? 0 : kTwoPi;
    sweep += kTwoPi * geometry.turns;
    return counterclockwise ? sweep : -sweep;
}

std::uint32_t chords_for(double sweep, double radius_mm) {
    // At least four to a turn: below a radius of 0.017 mm the tolerance alone would allow fewer.
    const double cosine = std::max(1 - kArcToleranceMm / radius_mm, 0.7071067811865476);
    const double step = 2 * std::acos(cosine);
    return static_cast<std::uint32_t>(std::max(1.0, std::ceil(std::abs(sweep) / step)));
}

}  // namespace

Result<ArcPath> ArcPath::make(const Position& from, const Position& to, const ArcGeometry& geometry) {
    QDUINO_TRY_ASSIGN(const Centre centre, centre_of(from, to, geometry));
    const PlaneAxes axes = axes_of(geometry.plane);
    const double from_first = from[axes.first].value() - centre.first_mm;
    const double from_second = from[axes.second].value() - centre.second_mm;
    const double to_first = to[axes.first].value() - centre.first_mm;
    const double to_second = to[axes.second].value() - centre.second_mm;
    ArcPath arc;
    arc.axes_ = axes;
    arc.from_ = from;
    arc.to_ = to;
    arc.centre_first_mm_ = centre.first_mm;
    arc.centre_second_mm_ = centre.second_mm;
    arc.radius_from_mm_ = std::hypot(from_first, from_second);
    arc.radius_to_mm_ = std::hypot(to_first, to_second);
    const double radius_max = std::max(arc.radius_from_mm_, arc.radius_to_mm_);
    if (!(arc.radius_from_mm_ > 0))
        return make_error(ErrorCode::invalid_argument, "an arc needs a centre that is not its start");
    if (!(radius_max <= kArcRadiusMaxMm)) {
        return make_error(ErrorCode::out_of_range, "the radius of the arc is above 100 m");
    }
    const bool same_point = is_same_place((to[axes.first] - from[axes.first]).value(),
                                          (to[axes.second] - from[axes.second]).value());
    arc.angle_from_ = std::atan2(from_second, from_first);
    arc.sweep_ = sweep_of(arc.angle_from_, std::atan2(to_second, to_first), same_point, geometry);
    const double mismatch_mm = std::abs(arc.radius_from_mm_ - arc.radius_to_mm_);
    if (arc.sweep_ != 0 && mismatch_mm > kArcRadiusMismatchMm) {
        return make_error(ErrorCode::invalid_argument, "the ends of the arc are ",
                          Fixed{arc.radius_from_mm_, 3}, " and ", Fixed{arc.radius_to_mm_, 3},
                          " mm from its centre: no circle goes through both");
    }
    arc.chords_ = chords_for(arc.sweep_, radius_max);
    return arc;
}

Position ArcPath::point(std::uint32_t index) const {
    QDUINO_EXPECT(index < chords_);
    if (index + 1 == chords_) return to_;
    const double along = static_cast<double>(index + 1) / chords_;
    const double radius = radius_from_mm_ + (radius_to_mm_ - radius_from_mm_) * along;
    const double angle = angle_from_ + sweep_ * along;
    Position point;
    for (const Axis axis : kAllAxes) point[axis] = from_[axis] + (to_[axis] - from_[axis]) * along;
    point[axes_.first] = Millimetres{centre_first_mm_ + radius * std::cos(angle)};
    point[axes_.second] = Millimetres{centre_second_mm_ + radius * std::sin(angle)};
    return point;
}

}  // namespace qduino::printer::gcode
