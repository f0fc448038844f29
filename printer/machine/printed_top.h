// How high what a job has printed stands: is the head above it? A job without an end code would
// leave the nozzle in the part. Beside the part and below its top the nozzle touches nothing, but
// whatever moves it next may drive it through the part: the way home, a jog, the way to the park
// place.
//
// Pure; loop 1.
#pragma once

#include <algorithm>

#include "printer/gcode/actions.h"

namespace qduino::printer::machine {

class PrintedTop {
  public:
    /// So far above it the head touches nothing, mm.
    static constexpr double kAbove_mm = 1;

    void forget() { empty_ = true; }
    void include(const gcode::Move& move) {
        const bool pushes = move.kind == gcode::MoveKind::print && move.to[Axis::e] > move.from[Axis::e];
        if (!pushes) return;
        const double higher_mm = std::max(move.from[Axis::z].value(), move.to[Axis::z].value());
        top_mm_ = empty_ ? higher_mm : std::max(top_mm_, higher_mm);
        empty_ = false;
    }
    /// Nothing has been printed.
    [[nodiscard]] bool empty() const { return empty_; }
    /// A head at this height (mm, as G-code counts machine coordinates) may stand in the way of
    /// something printed.
    [[nodiscard]] bool reaches(double z_mm) const { return !empty_ && z_mm < top_mm_ + kAbove_mm; }
    /// How high a head at `z_mm` must go at least before it goes sideways: over what stands higher,
    /// an object that was finished before this one.
    [[nodiscard]] double clear_mm(double z_mm) const {
        return !empty_ && z_mm < top_mm_ ? top_mm_ + kAbove_mm : z_mm;
    }

  private:
    bool empty_ = true;
    double top_mm_ = 0;
};

}  // namespace qduino::printer::machine
