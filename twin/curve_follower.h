// Curves. A firmware makes chords of its own of an arc. Near the place where the arc turns back, a
// chord that is 5 µm beside it crosses a half step half a millimetre early, or never. So on curves
// the cursor does not follow crossings. It moves forward to the place of the true curve that is
// nearest to where the slides stand, and the distance from there, square to the curve, is noted:
//
//        built ●               deviation = the part of (built − asked(s)) square to the curve; at
//          ´  ↕ ` .            most 0.71 steps and what the firmware's chord is off. How far along
//      ´  asked(s)   `         the curve the slides stand is told by E alone.
//
// Deviations from curves are noted apart from those of straight pieces, with a tolerance of their
// own (report.h).
#pragma once

#include "twin/path_cursor.h"

namespace qduino::twin {

class CurveFollower {
  public:
    /// A place that is no further off than this and a chord needs no look behind the curve.
    static constexpr double kOnCurveSteps = 0.75;

    /// `cursor` outlives this.
    explicit CurveFollower(PathCursor& cursor) : cursor_(cursor) {}

    /// Moves `place`, which is on a curve, forward on its chord to the place nearest to where the
    /// slides stand. True when the next chord brings it nearer still.
    [[nodiscard]] bool project(PathPlace& place);
    /// The slides are no further from `place` than that, and what a chord may be off.
    [[nodiscard]] bool is_near(const PathPlace& place, double limit_steps) const;
    /// The cursor goes there, and notes how far the slides are beside the curve.
    void commit(const PathPlace& place);

  private:
    [[nodiscard]] double coarser_steps(std::size_t axis, const AskedPiece& here) const;

    PathCursor& cursor_;
};

}  // namespace qduino::twin
