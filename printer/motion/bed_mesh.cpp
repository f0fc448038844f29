#include "printer/motion/bed_mesh.h"

#include <algorithm>
#include <cmath>

namespace qduino::printer::motion {
namespace {

/// The Catmull–Rom spline from `b` (share 0) to `c` (share 1).
double catmull_rom(double a, double b, double c, double d, double share) {
    const double slope = (c - a) / 2, next_slope = (d - b) / 2, rise = c - b;
    return b + share * (slope + share * (3 * rise - 2 * slope - next_slope +
                                         share * (slope + next_slope - 2 * rise)));
}

/// The surface along one line of `count` values, which `value_of(index)` gives.
template <typename ValueOf>
double along(MeshSurface surface, std::size_t count, std::size_t cell, double share, ValueOf&& value_of) {
    const double b = value_of(cell), c = value_of(cell + 1);
    if (surface == MeshSurface::bilinear) return b + share * (c - b);
    // Beyond the last lines the slope goes on.
    const double a = cell > 0 ? value_of(cell - 1) : 2 * b - c;
    const double d = cell + 2 < count ? value_of(cell + 2) : 2 * c - b;
    return catmull_rom(a, b, c, d, share);
}

}  // namespace

double BedMesh::line_at(Axis axis, std::size_t index) const {
    const std::size_t i = axis == Axis::x ? 0 : 1;
    const double low = config_.minimum[i].value(), high = config_.maximum[i].value();
    return low + (high - low) * static_cast<double>(index) / static_cast<double>(config_.points[i] - 1);
}

BedMesh::Place BedMesh::place_of(Axis axis, double mm) const {
    const std::size_t cells = lines(axis) - 1;
    const double low = line_at(axis, 0), high = line_at(axis, cells);
    const double at = std::clamp((mm - low) / (high - low), 0.0, 1.0) * static_cast<double>(cells);
    const std::size_t cell = std::min(static_cast<std::size_t>(at), cells - 1);
    return {cell, at - static_cast<double>(cell)};
}

double BedMesh::along_row(std::size_t row, const Place& x) const {
    return along(config_.surface, lines(Axis::x), x.cell, x.share,
                 [&](std::size_t column) { return heights_[row][column]; });
}

double BedMesh::height_at(double x, double y) const {
    if (!known_) return 0;
    const Place across = place_of(Axis::x, x), up = place_of(Axis::y, y);
    return along(config_.surface, lines(Axis::y), up.cell, up.share,
                 [&](std::size_t row) { return along_row(row, across); });
}

}  // namespace qduino::printer::motion
