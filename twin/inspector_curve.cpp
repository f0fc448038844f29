// The inspector on curves: see "Curves" in inspector.h.
#include <algorithm>
#include <cmath>

#include "twin/inspector.h"

namespace qduino::twin {

// Moves `cursor`, which is on a curve, forward on its chord to the place nearest to where the
// slides stand. True when the next chord brings it nearer still.
bool Inspector::project(Cursor& cursor) {
    cursor.share = nearest_share(pieces_[cursor.piece], cursor.share);
    cursor.at = point_on(pieces_[cursor.piece], cursor.share);
    cursor.curved = true;
    if (cursor.share < 1 || cursor.piece + 1 >= kLookAhead) return false;
    const Piece& next = piece(cursor.piece + 1);
    return next.curved && nearest_share(next, 0) > 0;
}

// The share of `here`, not less than `from`, nearest to where the slides stand, in mm.
double Inspector::nearest_share(const Piece& here, double from) const {
    double along = 0;
    double length2 = 0;
    for (std::size_t axis = 0; axis < kSlideCount; ++axis) {
        const double steps_per_mm = machine_.axes[axis].steps_per_mm;
        const double way = (here.to[axis] - here.from[axis]) / steps_per_mm;
        along += way * (so_far_.built[axis] - here.from[axis]) / steps_per_mm;
        length2 += way * way;
    }
    return length2 > 0 ? std::clamp(along / length2, from, 1.0) : 1.0;
}

// What the half steps of the other axes may add to an axis, square to the curve, beyond the quarter
// of a step that the tolerance has for axes of equal steps. For e square to t it is t·Σ|e·t|: on a
// helix that climbs steeply a coarse X and Y show in a fine Z.
double Inspector::coarser_steps(std::size_t axis, const Piece& here) const {
    double length2 = 0, others = 0;
    for (std::size_t other = 0; other < kSlideCount; ++other) {
        const double way_steps = std::abs(here.to[other] - here.from[other]);
        const double step_mm = 1 / machine_.axes[other].steps_per_mm;
        length2 += way_steps * step_mm * way_steps * step_mm;
        if (other != axis) others += 0.5 * way_steps * step_mm * step_mm;
    }
    const double own = std::abs(here.to[axis] - here.from[axis]);
    return length2 > 0 ? std::max(own * others / length2 - 0.25, 0.0) : 0;
}

// A chord may be beside the curve along the axes that the curve moves.
bool Inspector::is_near_curve(const Cursor& cursor, double limit_steps) const {
    const Piece& here = pieces_[cursor.piece];
    for (std::size_t axis = 0; axis < kSlideCount; ++axis) {
        const double chord_mm = here.from[axis] != here.to[axis] ? kChordMm : 0;
        const double allowed = limit_steps + slack_steps(axis) + coarser_steps(axis, here) +
                               chord_mm * machine_.axes[axis].steps_per_mm;
        if (std::abs(so_far_.built[axis] - cursor.at[axis]) > allowed) return false;
    }
    return true;
}

// The cursor goes there, and notes how far the slides are beside the curve.
void Inspector::commit_on_curve(const Cursor& cursor) {
    drop_passed(cursor);
    const Piece& here = pieces_.front();
    std::array<double, kSlideCount> off_mm{};
    std::array<double, kSlideCount> way_mm{};
    double along = 0;
    double length2 = 0;
    for (std::size_t axis = 0; axis < kSlideCount; ++axis) {
        const double steps_per_mm = machine_.axes[axis].steps_per_mm;
        off_mm[axis] = (so_far_.built[axis] - so_far_.at[axis]) / steps_per_mm;
        way_mm[axis] = (here.to[axis] - here.from[axis]) / steps_per_mm;
        along += off_mm[axis] * way_mm[axis];
        length2 += way_mm[axis] * way_mm[axis];
    }
    for (std::size_t axis = 0; axis < kSlideCount; ++axis) {
        const double beside_mm = off_mm[axis] - (length2 > 0 ? along / length2 * way_mm[axis] : 0);
        const double steps_per_mm = machine_.axes[axis].steps_per_mm;
        const double beside_steps = std::abs(beside_mm) * steps_per_mm - coarser_steps(axis, here);
        note(axis, std::max(beside_steps, 0.0), true);
    }
    note(kExtruder, std::abs(so_far_.built[kExtruder] - so_far_.at[kExtruder]), true);
}

}  // namespace qduino::twin
