// The bed as a print's own probing found it, and the surface that a print should follow.
//
//   touch at (x, y): the nearest point of the grid has that height. Between the points: a plane
//   between two lines each way, or Catmull–Rom's cubic through four. Beside the grid: as at its
//   edge.
//
// The firmware's mesh shares nothing with this: a mistake in one must not hide in the other.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "twin/machine.h"

namespace qduino::twin {

class BedMap {
  public:
    explicit BedMap(const GridSpec& grid)
        : grid_(grid), heights_(static_cast<std::size_t>((grid.points[0] + 2) * (grid.points[1] + 2))) {}

    explicit BedMap(const KnownBedSpec& known) : BedMap(known.grid) {
        for (std::size_t i = 0; i < known.heights.size(); ++i) {
            const auto column = static_cast<int>(i) % grid_.points[0],
                       row = static_cast<int>(i) / grid_.points[0];
            at(column, row) = known.heights[i];
            ++touches_;
        }
    }

    /// The probe touched the bed there. Heights are of the nozzle that would touch it.
    void touch(double x, double y, double height) {
        at(nearest(0, x), nearest(1, y)) = height;
        ++touches_;
    }
    [[nodiscard]] bool complete() const { return touches_ >= grid_.points[0] * grid_.points[1]; }

    [[nodiscard]] double height_at(double x, double y) const {
        const Weights across = weights(0, x), up = weights(1, y);
        double height = 0;
        for (int row = -1; row < 3; ++row)
            for (int column = -1; column < 3; ++column)
                height += across.of[column + 1] * up.of[row + 1] * value(across.cell + column, up.cell + row);
        return height;
    }

  private:
    /// The weights of the four lines around a place: cell − 1 … cell + 2.
    struct Weights {
        int cell = 0;
        std::array<double, 4> of{};
    };

    [[nodiscard]] double place(std::size_t axis, double mm) const {
        const double span = grid_.maximum_mm[axis] - grid_.minimum_mm[axis];
        return std::clamp((mm - grid_.minimum_mm[axis]) / span, 0.0, 1.0) * (grid_.points[axis] - 1);
    }
    [[nodiscard]] int nearest(std::size_t axis, double mm) const {
        return static_cast<int>(std::lround(place(axis, mm)));
    }
    [[nodiscard]] Weights weights(std::size_t axis, double mm) const {
        const double there = place(axis, mm);
        Weights weights{std::min(static_cast<int>(there), grid_.points[axis] - 2), {}};
        const double s = there - weights.cell;
        if (!grid_.bicubic) {
            weights.of = {0, 1 - s, s, 0};
            return weights;
        }
        const double s2 = s * s, s3 = s2 * s;
        weights.of = {(2 * s2 - s - s3) / 2, (2 - 5 * s2 + 3 * s3) / 2, (s + 4 * s2 - 3 * s3) / 2,
                      (s3 - s2) / 2};
        return weights;
    }

    double& at(int column, int row) {
        return heights_[static_cast<std::size_t>(row * grid_.points[0] + column)];
    }
    /// Beyond the last line the slope goes on.
    [[nodiscard]] double value(int column, int row) const {
        const auto inside = [&](int c, int r) {
            return heights_[static_cast<std::size_t>(r * grid_.points[0] + c)];
        };
        const auto in_row = [&](int r) {
            const int last = grid_.points[0] - 1;
            if (column < 0) return 2 * inside(0, r) - inside(1, r);
            return column > last ? 2 * inside(last, r) - inside(last - 1, r) : inside(column, r);
        };
        const int last = grid_.points[1] - 1;
        if (row < 0) return 2 * in_row(0) - in_row(1);
        return row > last ? 2 * in_row(last) - in_row(last - 1) : in_row(row);
    }

    GridSpec grid_;
    std::vector<double> heights_;
    int touches_ = 0;
};

}  // namespace qduino::twin
