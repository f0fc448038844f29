// Cubic Bézier splines (G5) as chains of chords, none further than `kArcToleranceMm` from the true
// curve.
//
//   P0 = start      P1 = P0 + (I, J)      P2 = P3 + (P, Q)      P3 = end
//
//   B(t) = (1−t)³ P0 + 3 (1−t)² t P1 + 3 (1−t) t² P2 + t³ P3
//
// Between two points of the curve that are h apart in t, the chord leaves it by h²/8 · max|B''| at
// most, and |B''| ≤ 6 · max(|P0 − 2 P1 + P2|, |P1 − 2 P2 + P3|). Z and E advance evenly with t, as
// Marlin's do (G005). The curve lies in XY.
#pragma once

#include <cstdint>

#include "base/result.h"
#include "printer/gcode/position.h"

namespace qduino::printer::gcode {

/// The control points of a G5, in mm from the start and from the end.
struct SplineGeometry {
    double start_dx_mm = 0;  ///< I
    double start_dy_mm = 0;  ///< J
    double end_dx_mm = 0;    ///< P
    double end_dy_mm = 0;    ///< Q
};

class SplinePath {
  public:
    /// Error: a control point is further away than kArcRadiusMaxMm.
    static Result<SplinePath> make(const Position& from, const Position& to, const SplineGeometry& geometry);

    [[nodiscard]] std::uint32_t chords() const { return chords_; }
    /// End of chord `index` (0 … chords() − 1); the last is exactly the spline's end.
    [[nodiscard]] Position point(std::uint32_t index) const;
    [[nodiscard]] const Position& end() const { return to_; }

  private:
    Position from_;
    Position to_;
    double x_mm_[4] = {};
    double y_mm_[4] = {};
    std::uint32_t chords_ = 1;
};

}  // namespace qduino::printer::gcode
