#include "twin/curve_follower.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace qduino::twin {

bool CurveFollower::project(PathPlace& place) {
    AskedPieces& pieces = cursor_.pieces();
    place.share = cursor_.nearest_share(pieces[place.piece], place.share);
    place.at = pieces[place.piece].at(place.share);
    place.curved = true;
    if (place.share < 1 || place.piece + 1 >= PathCursor::kLookAhead) return false;
    const AskedPiece& next = pieces.piece(place.piece + 1);
    return next.curved && cursor_.nearest_share(next, 0) > 0;
}

// What the half steps of the other axes may add to an axis, square to the curve, beyond the quarter
// of a step that the tolerance has for axes of equal steps. For e square to t it is t·Σ|e·t|: on a
// helix that climbs steeply a coarse X and Y show in a fine Z.
double CurveFollower::coarser_steps(std::size_t axis, const AskedPiece& here) const {
    double length2 = 0, others = 0;
    for (std::size_t other = 0; other < kSlideCount; ++other) {
        const double way_steps = std::abs(here.to[other] - here.from[other]);
        const double step_mm = 1 / cursor_.steps_per_mm(other);
        length2 += way_steps * step_mm * way_steps * step_mm;
        if (other != axis) others += 0.5 * way_steps * step_mm * step_mm;
    }
    const double own = std::abs(here.to[axis] - here.from[axis]);
    return length2 > 0 ? std::max(own * others / length2 - 0.25, 0.0) : 0;
}

// A chord may be beside the curve along the axes that the curve moves.
bool CurveFollower::is_near(const PathPlace& place, double limit_steps) const {
    const AskedPiece& here = cursor_.pieces()[place.piece];
    for (std::size_t axis = 0; axis < kSlideCount; ++axis) {
        const double chord_mm = here.from[axis] != here.to[axis] ? PathCursor::kChordMm : 0;
        const double allowed = limit_steps + cursor_.allowance().slack_steps(axis) +
                               coarser_steps(axis, here) + chord_mm * cursor_.steps_per_mm(axis);
        if (std::abs(cursor_.so_far().built[axis] - place.at[axis]) > allowed) return false;
    }
    return true;
}

void CurveFollower::commit(const PathPlace& place) {
    cursor_.go_to(place);
    const Comparison& so_far = cursor_.so_far();
    const AskedPiece& here = cursor_.pieces().front();
    std::array<double, kSlideCount> off_mm{};
    std::array<double, kSlideCount> way_mm{};
    double along = 0;
    double length2 = 0;
    for (std::size_t axis = 0; axis < kSlideCount; ++axis) {
        const double steps_per_mm = cursor_.steps_per_mm(axis);
        off_mm[axis] = (so_far.built[axis] - so_far.at[axis]) / steps_per_mm;
        way_mm[axis] = (here.to[axis] - here.from[axis]) / steps_per_mm;
        along += off_mm[axis] * way_mm[axis];
        length2 += way_mm[axis] * way_mm[axis];
    }
    for (std::size_t axis = 0; axis < kSlideCount; ++axis) {
        const double beside_mm = off_mm[axis] - (length2 > 0 ? along / length2 * way_mm[axis] : 0);
        const double beside_steps =
            std::abs(beside_mm) * cursor_.steps_per_mm(axis) - coarser_steps(axis, here);
        cursor_.note(axis, std::max(beside_steps, 0.0), true);
    }
    cursor_.note_all(true);
}

}  // namespace qduino::twin
