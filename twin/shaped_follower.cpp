#include "twin/shaped_follower.h"

#include <algorithm>
#include <cmath>

#include "twin/straight_follower.h"

namespace qduino::twin {
namespace {

bool moves_slides(const AskedPiece& piece) {
    for (std::size_t axis = 0; axis < kSlideCount; ++axis)
        if (piece.from[axis] != piece.to[axis]) return true;
    return false;
}

// Slides stand on whole steps, and so may never be seen at the very end.
bool is_at_end(const AskedPiece& piece, double share) {
    for (std::size_t axis = 0; axis < kSlideCount; ++axis)
        if (std::abs(piece.to[axis] - piece.from[axis]) * (1 - share) > Excursions::kCleanSteps) return false;
    return true;
}

}  // namespace

// Filament moves alone, or further than the slides: on such a piece E knows the place better.
bool ShapedFollower::filament_leads(const AskedPiece& piece) const {
    double way_mm2 = 0;
    for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
        const double way_mm = (piece.to[axis] - piece.from[axis]) / cursor_.steps_per_mm(axis);
        way_mm2 += axis == kExtruder ? -way_mm * way_mm : way_mm * way_mm;
    }
    return way_mm2 <= 0;
}

// A way that comes back on itself looks the same before filament moves alone and after. E knows.
bool ShapedFollower::filament_is_past(const AskedPiece& piece) const {
    const double way = piece.to[kExtruder] > piece.from[kExtruder] ? 1 : -1;
    return way * (cursor_.so_far().built[kExtruder] - piece.to[kExtruder]) >=
           -StraightFollower::kWaitingSteps;
}

// Moves `place` forward along its piece to the first place that is within `balls` of the slides;
// false when there is none.
bool ShapedFollower::first_within(PathPlace& place, double balls) const {
    const AskedPiece& here = cursor_.pieces()[place.piece];
    double low = place.share, high = 1;
    for (std::size_t axis = 0; axis < kSlideCount; ++axis) {
        const double length = here.to[axis] - here.from[axis];
        const double ahead = cursor_.so_far().built[axis] - here.from[axis];
        const double wide = balls * cursor_.ball_steps(axis);
        if (length == 0) {
            if (std::abs(ahead) > wide) return false;
            continue;
        }
        const double one = (ahead - wide) / length, other = (ahead + wide) / length;
        low = std::max(low, std::min(one, other));
        high = std::min(high, std::max(one, other));
    }
    if (low > high) return false;
    place.share = low;
    return true;
}

// Looks on from `place` for a place within `balls`, past nothing that the slides cannot have been
// near.
bool ShapedFollower::find_within(PathPlace& place, double balls) {
    while (place.piece < PathCursor::kLookAhead) {
        const AskedPiece& here = cursor_.pieces().piece(place.piece);
        const bool done = place.piece == 0 && place.share >= 1;  // a homing, maybe
        if (here.kind != AskedItem::Kind::move && !done) return false;
        if (first_within(place, balls)) return true;
        if (cursor_.beside(here.to) > PathCursor::kPassBalls) return false;
        ++place.piece;
        place.share = 0;
    }
    return false;
}

bool ShapedFollower::follow(const MotorStep& step) {
    if (begins_at_rest(step)) return false;
    PathPlace place = this->place();
    const bool found = find_within(place, 1);
    const AskedItem::Kind kind = cursor_.pieces().piece(place.piece).kind;
    if (!found && kind == AskedItem::Kind::home && homing_.begins(place, step)) return false;
    if (!found && kind == AskedItem::Kind::probe && probing_.begins(place, step)) return false;
    if (found) {
        cursor_.so_far().unexplained_run = 0;
        cursor_.go_to(place);
    } else {
        cursor_.so_far().count_unexplained(step.axis);
    }
    show_place();
    cursor_.note_all(cursor_.shown().curved);
    return found;
}

// The cursor stands at the end of what leads to a homing, or to a probing.
bool ShapedFollower::begins_at_rest(const MotorStep& step) {
    AskedPieces& pieces = cursor_.pieces();
    const AskedPiece& here = pieces.front();
    if (cursor_.so_far().share < 1 && (moves_slides(here) || !filament_is_past(here))) return false;
    std::size_t next = 1;
    for (; pieces.piece(next).kind == AskedItem::Kind::move && !moves_slides(pieces[next]); ++next)
        if (!filament_is_past(pieces[next])) return false;
    const AskedItem::Kind kind = pieces[next].kind;
    const PathPlace there{next, 0, pieces[next].from, {}, false};
    if (kind == AskedItem::Kind::home) return homing_.begins(there, step);
    return kind == AskedItem::Kind::probe && probing_.begins(there, step);
}

// Filament that moves alone moves the cursor: where the slides are near such a piece, and E is on
// it. Every other piece is led by the slides.
void ShapedFollower::follow_extruder(const MotorStep& step) {
    PathPlace place = this->place();
    for (; place.piece < PathCursor::kLookAhead; ++place.piece, place.share = 0) {
        const AskedPiece& here = cursor_.pieces().piece(place.piece);
        const bool done = place.piece == 0 && place.share >= 1;
        const double beside = cursor_.beside(here.to);
        if ((here.kind != AskedItem::Kind::move && !done) || beside > PathCursor::kPassBalls) break;
        if (!filament_leads(here) || done) continue;
        const bool found = beside <= 1 && cursor_.creep(place, step);
        if (found) cursor_.go_to(place);
        if (found || place.piece > 0) break;
    }
    show_place();
    cursor_.note(kExtruder, std::abs(step.boundary - cursor_.so_far().at[kExtruder]), cursor_.shown().curved);
}

// The place to be shown and compared: from the cursor on as long as the slides come nearer.
void ShapedFollower::show_place() {
    AskedPieces& pieces = cursor_.pieces();
    PathPlace place = this->place();
    while (place.piece < PathCursor::kLookAhead) {
        const AskedPiece& here = pieces[place.piece];
        const bool led = filament_leads(here);
        if (!led) place.share = cursor_.nearest_share(here, place.share);
        if (!led && !is_at_end(here, place.share)) break;
        std::size_t next = place.piece + 1;
        bool pushed = place.share >= 1 || !led || filament_is_past(here);
        for (; pieces.piece(next).kind == AskedItem::Kind::move && filament_leads(pieces[next]); ++next)
            pushed = pushed && filament_is_past(pieces[next]);
        if (pieces[next].kind != AskedItem::Kind::move || !pushed) break;
        if (cursor_.nearest_share(pieces[next], 0) <= 0) break;
        place.piece = next;
        place.share = 0;
    }
    cursor_.show(place.piece, place.share);
}

void ShapedFollower::rest() {
    PathPlace place = this->place();
    double finest = 1;
    for (std::size_t axis = 0; axis < kSlideCount; ++axis)
        finest = std::min(finest, Excursions::kCleanSteps / cursor_.ball_steps(axis));
    if (!find_within(place, finest)) return;
    const AskedPiece& here = cursor_.pieces()[place.piece];
    if (moves_slides(here)) place.share = cursor_.nearest_share(here, place.share);
    place.at = here.at(place.share);
    cursor_.go_to(place);
}

}  // namespace qduino::twin
