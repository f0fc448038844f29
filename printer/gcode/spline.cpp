#include "printer/gcode/spline.h"

#include <algorithm>
#include <cmath>

#include "printer/gcode/arc.h"

namespace qduino::printer::gcode {
namespace {

double bernstein(const double (&p)[4], double t) {
    const double s = 1 - t;
    return s * s * s * p[0] + 3 * s * s * t * p[1] + 3 * s * t * t * p[2] + t * t * t * p[3];
}

}  // namespace

Result<SplinePath> SplinePath::make(const Position& from, const Position& to,
                                    const SplineGeometry& geometry) {
    const double largest = std::max({std::abs(geometry.start_dx_mm), std::abs(geometry.start_dy_mm),
                                     std::abs(geometry.end_dx_mm), std::abs(geometry.end_dy_mm)});
    if (!(largest <= kArcRadiusMaxMm))
        return make_error(ErrorCode::out_of_range, "a control point of the spline is above 100 m away");
    SplinePath path;
    path.from_ = from;
    path.to_ = to;
    path.x_mm_[0] = from[Axis::x].value();
    path.y_mm_[0] = from[Axis::y].value();
    path.x_mm_[3] = to[Axis::x].value();
    path.y_mm_[3] = to[Axis::y].value();
    path.x_mm_[1] = path.x_mm_[0] + geometry.start_dx_mm;
    path.y_mm_[1] = path.y_mm_[0] + geometry.start_dy_mm;
    path.x_mm_[2] = path.x_mm_[3] + geometry.end_dx_mm;
    path.y_mm_[2] = path.y_mm_[3] + geometry.end_dy_mm;
    double bend = 0;
    for (int i = 0; i < 2; ++i) {
        bend = std::max(bend, std::hypot(path.x_mm_[i] - 2 * path.x_mm_[i + 1] + path.x_mm_[i + 2],
                                         path.y_mm_[i] - 2 * path.y_mm_[i + 1] + path.y_mm_[i + 2]));
    }
    const double chords = std::ceil(std::sqrt(6 * bend / (8 * kArcToleranceMm)));
    path.chords_ = static_cast<std::uint32_t>(std::max(1.0, chords));
    return path;
}

Position SplinePath::point(std::uint32_t index) const {
    QDUINO_EXPECT(index < chords_);
    if (index + 1 == chords_) return to_;
    const double t = static_cast<double>(index + 1) / chords_;
    Position point;
    point[Axis::x] = Millimetres{bernstein(x_mm_, t)};
    point[Axis::y] = Millimetres{bernstein(y_mm_, t)};
    point[Axis::z] = from_[Axis::z] + (to_[Axis::z] - from_[Axis::z]) * t;
    point[Axis::e] = from_[Axis::e] + (to_[Axis::e] - from_[Axis::e]) * t;
    return point;
}

}  // namespace qduino::printer::gcode
