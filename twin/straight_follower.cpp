#include "twin/straight_follower.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace qduino::twin {

bool StraightFollower::follow(const MotorStep& step) {
    Comparison& so_far = cursor_.so_far();
    // The path has been beyond the step's boundary: the step is late. On the boundary itself, a
    // step the other way may just have put the cursor there, so the path ahead is asked first.
    // On a curve crossings say nothing.
    const bool curved = cursor_.pieces().front().curved;
    const double beyond = step.direction * (so_far.at[step.axis] - step.boundary);
    const bool ahead = curved || beyond <= PathCursor::kTieSteps + cursor_.early_steps();
    const bool found = ahead && (advance_in_piece(step) || (so_far.unexplained_run < kGiveUp && walk(step)));
    if (found || (!curved && beyond >= -PathCursor::kTieSteps)) {
        if (!found) cursor_.note(step.axis, std::abs(beyond) + 0.5, curved);
        so_far.unexplained_run = 0;
        return found;
    }
    so_far.count_unexplained(step.axis);
    cursor_.note(step.axis, so_far.off(step.axis), curved);
    return false;
}

// Nearly every step ends here: the boundary lies on the piece that the cursor is on.
bool StraightFollower::advance_in_piece(const MotorStep& step) {
    const AskedPiece& here = cursor_.pieces().front();
    if (here.kind != AskedItem::Kind::move || here.curved) return false;
    PathPlace place = cursor_.place();
    if (step.direction * (here.to[step.axis] - step.boundary) < 0 || !cursor_.creep(place, step))
        return false;
    if (!cursor_.others_near(place, step)) return false;
    cursor_.advance(place);
    return true;
}

// Looks for the step's boundary on the pieces ahead, or for the place of a curve that the step
// leads to, and meanwhile for a homing that would explain the step. At the end of a curve a step
// beyond its last place may be the first one of what follows.
bool StraightFollower::walk(const MotorStep& step) {
    AskedPieces& pieces = cursor_.pieces();
    PathPlace place = cursor_.place();
    std::optional<PathPlace> on_curve;  // to take if nothing behind the curve explains the step
    while (place.piece < PathCursor::kLookAhead) {
        const AskedPiece& here = pieces[place.piece];
        if (here.curved) {
            const bool goes_on = curve_.project(place);
            const bool reached = place.share < 1 || step.direction * (place.at[step.axis] - step.boundary) >=
                                                        -PathCursor::kTieSteps;
            if (!goes_on && reached && curve_.is_near(place, CurveFollower::kOnCurveSteps))
                return curve_.commit(place), true;
            if (curve_.is_near(place, step.limit_steps)) on_curve = place;
            if (!cursor_.pass_end(place, step)) break;
        } else if (place.share < 1 || place.piece == 0) {
            if (here.kind == AskedItem::Kind::move && cursor_.creep(place, step)) {
                if (!cursor_.others_near(place, step)) break;
                return cursor_.commit(place), true;
            }
            if (!cursor_.pass_end(place, step)) break;
        }
        const AskedPiece& next = pieces.piece(++place.piece);
        place.share = 0;
        place.curved = place.curved || next.curved;
        if (next.kind == AskedItem::Kind::move) continue;
        if (next.kind == AskedItem::Kind::home && homing_.begins(place, step)) return true;
        if (next.kind == AskedItem::Kind::probe && probing_.begins(place, step)) return true;
        break;
    }
    if (on_curve) curve_.commit(*on_curve);
    return on_curve.has_value();
}

// The extruder moves the cursor at most to where a slide is due to step.
void StraightFollower::follow_extruder(const MotorStep& step) {
    AskedPieces& pieces = cursor_.pieces();
    const Comparison& so_far = cursor_.so_far();
    const double way = step.direction;
    const double before = so_far.built[kExtruder] - way;
    cursor_.note(kExtruder, std::abs(so_far.at[kExtruder] - before), pieces.front().curved);
    PathPlace place = cursor_.place();
    const bool behind = way * (step.boundary - so_far.at[kExtruder]) >
                        kWaitingSteps + cursor_.allowance().extruder_reach_steps();
    bool found = way * (so_far.at[kExtruder] - step.boundary) > PathCursor::kTieSteps;
    while (!found && place.piece < PathCursor::kLookAhead) {
        const AskedPiece& here = pieces[place.piece];
        if (here.kind == AskedItem::Kind::move) {
            const double reach = slides_reach(place, behind);
            PathPlace crossing = place;
            found = cursor_.creep(crossing, step) && crossing.share <= reach;
            if (found) {
                place = crossing;
            } else {
                place.share = reach;
                place.at = here.at(reach);
            }
            if (found || reach < 1) break;
        }
        place.worst[kExtruder] = std::max(place.worst[kExtruder], std::abs(before - place.at[kExtruder]));
        const AskedPiece& next = pieces.piece(place.piece + 1);
        if (next.kind != AskedItem::Kind::move) break;
        ++place.piece;
        place.share = 0;
        place.curved = place.curved || next.curved;
    }
    cursor_.commit(place);
}

// Share of the place's piece up to which every slide stays within half a step of its position; not
// less than the place's. `behind`: E waits, so no step is waited for that a slide may leave out.
double StraightFollower::slides_reach(const PathPlace& place, bool behind) {
    double reach = 1;
    for (std::size_t axis = 0; axis < kSlideCount; ++axis) {
        const AskedPiece& here = cursor_.pieces()[place.piece];
        const double length = here.to[axis] - here.from[axis];
        if (length == 0) continue;
        const double way = length > 0 ? 1 : -1;
        const double edge = cursor_.so_far().built[axis] + 0.5 * way;
        const double share = (edge - here.from[axis]) / length;
        if (share >= reach || (behind && turns_back(axis, place.piece, edge, way))) continue;
        reach = share;
    }
    return std::max(reach, place.share);
}

// The path goes beyond the slide's `edge` by no more than may be left out, and comes back.
bool StraightFollower::turns_back(std::size_t axis, std::size_t index, double edge, double way) {
    const double most = cursor_.allowance().turn_steps(axis);
    for (std::size_t i = index; i < index + PathCursor::kAround; ++i) {
        const AskedPiece& there = cursor_.pieces().piece(i);
        const double beyond = way * (there.to[axis] - edge);
        if (there.kind != AskedItem::Kind::move || beyond > most) return false;
        if (beyond <= 0) return true;
    }
    return false;
}

}  // namespace qduino::twin
