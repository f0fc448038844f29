// The order in which a bed is probed: along X, and every second row backwards, so that no way is
// long.
//
//   row 2  ─────►●      the last place: the nozzle stays there, at the clearance
//   row 1  ◄─────
//   row 0  ─────►
#pragma once

#include <cstddef>

#include "printer/machine_config.h"

namespace qduino::printer {

struct ProbePlace {
    std::size_t column = 0;
    std::size_t row = 0;
    /// The place of the nozzle while the probe is above the grid's point.
    Millimetres x{};
    Millimetres y{};
};

constexpr std::size_t probe_count(const MeshConfig& mesh) { return mesh.points[0] * mesh.points[1]; }

/// Contract: `index` is below probe_count(), and the grid has at least 2 × 2 points.
constexpr ProbePlace probe_place(const MachineConfig& machine, std::size_t index) {
    const MeshConfig& mesh = machine.mesh;
    const std::size_t row = index / mesh.points[0], along = index % mesh.points[0];
    const std::size_t column = row % 2 == 0 ? along : mesh.points[0] - 1 - along;
    const auto at = [&](std::size_t axis, std::size_t line) {
        const double share = static_cast<double>(line) / static_cast<double>(mesh.points[axis] - 1);
        return mesh.minimum[axis] + (mesh.maximum[axis] - mesh.minimum[axis]) * share;
    };
    return {column, row, at(0, column) - machine.probe.x_offset, at(1, row) - machine.probe.y_offset};
}

}  // namespace qduino::printer
