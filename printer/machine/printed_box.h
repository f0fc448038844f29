// The box around what a job has printed: is the head still in it? A job without an end code would
// leave the nozzle in the part.
//
// Pure; loop 1.
#pragma once

#include <algorithm>

#include "printer/gcode/actions.h"

namespace qduino::printer::machine {

class PrintedBox {
  public:
    /// So far beside it the head touches nothing, mm.
    static constexpr double kBeside_mm = 2, kAbove_mm = 1;

    void forget() { empty_ = true; }
    void include(const gcode::Move& move) {
        const bool pushes = move.kind == gcode::MoveKind::print && move.to[Axis::e] > move.from[Axis::e];
        if (!pushes) return;
        for (const gcode::Position& end : {move.from, move.to}) {
            for (std::size_t i = 0; i < 3; ++i) {
                low_[i] = empty_ ? end[i].value() : std::min(low_[i], end[i].value());
                high_[i] = empty_ ? end[i].value() : std::max(high_[i], end[i].value());
            }
            empty_ = false;
        }
    }
    /// Nothing has been printed.
    [[nodiscard]] bool empty() const { return empty_; }
    /// `at`: mm, as G-code counts machine coordinates.
    [[nodiscard]] bool holds(const std::array<double, kAxisCount>& at) const {
        const auto beside = [&](std::size_t i) {
            return at[i] < low_[i] - kBeside_mm || at[i] > high_[i] + kBeside_mm;
        };
        return !empty_ && !beside(0) && !beside(1) && at[2] < high_[2] + kAbove_mm;
    }

  private:
    bool empty_ = true;
    std::array<double, 3> low_{}, high_{};
};

}  // namespace qduino::printer::machine
