// The bed as it is: a grid of measured heights, and a surface through them.
//
//   y ▲  h ── h ── h        bilinear   within a cell, h is linear along x and along y (Marlin's
//     │  │    │    │                   bilinear levelling, Klipper's own mesh)
//     │  h ── h ── h        bicubic    Catmull–Rom through the grid's lines, first along x, then
//     └──────────────► x               along y; beyond the last line the slope goes on (E. Catmull,
//                                      R. Rom 1974; Marlin's "bilinear subdivision")
//
// Outside of the grid the height is that of its edge.
//
// Pure; no heap. Lengths in mm; heights of the nozzle where it would touch the bed.
#pragma once

#include <array>
#include <cstddef>

#include "printer/machine_config.h"

namespace qduino::printer::motion {

class BedMesh {
  public:
    BedMesh() = default;
    /// All heights are 0.
    explicit BedMesh(const MeshConfig& config) : config_(config), known_(true) {}

    /// False: nothing has been measured.
    [[nodiscard]] bool known() const { return known_; }
    [[nodiscard]] const MeshConfig& config() const { return config_; }
    void set(std::size_t column, std::size_t row, double height) { heights_[row][column] = height; }
    [[nodiscard]] double point(std::size_t column, std::size_t row) const { return heights_[row][column]; }

    [[nodiscard]] double height_at(double x, double y) const;
    /// The coordinate on X or Y, in mm, of the grid's line `index` across that axis.
    [[nodiscard]] double line_at(Axis axis, std::size_t index) const;
    [[nodiscard]] std::size_t lines(Axis axis) const { return config_.points[axis == Axis::x ? 0 : 1]; }

    friend bool operator==(const BedMesh&, const BedMesh&) = default;

  private:
    /// Where on the grid: the cell, and the share of it.
    struct Place {
        std::size_t cell = 0;
        double share = 0;
    };
    [[nodiscard]] Place place_of(Axis axis, double mm) const;
    [[nodiscard]] double along_row(std::size_t row, const Place& x) const;

    MeshConfig config_{};
    bool known_ = false;
    std::array<std::array<double, kMeshPointsMax>, kMeshPointsMax> heights_{};
};

}  // namespace qduino::printer::motion
