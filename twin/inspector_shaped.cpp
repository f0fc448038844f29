// The inspector on a motion behind filters: see "Filters" in inspector.h.
#include <algorithm>
#include <cmath>
#include <limits>

#include "twin/inspector.h"

namespace qduino::twin {

bool Inspector::moves_slides(const Piece& piece) {
    for (std::size_t axis = 0; axis < kSlideCount; ++axis)
        if (piece.from[axis] != piece.to[axis]) return true;
    return false;
}

// Filament moves alone, or further than the slides: on such a piece E knows the place better.
bool Inspector::filament_leads(const Piece& piece) const {
    double way_mm2 = 0;
    for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
        const double way_mm = (piece.to[axis] - piece.from[axis]) / machine_.axes[axis].steps_per_mm;
        way_mm2 += axis == kExtruder ? -way_mm * way_mm : way_mm * way_mm;
    }
    return way_mm2 <= 0;
}

// How far a slide's motor may be from where the plan is.
double Inspector::ball_steps(std::size_t axis) const {
    const double lost = static_cast<double>(so_far_.unexplained_run) - 2 * static_cast<double>(kAwaySteps);
    return kAstraySteps + slack_steps(axis) + kChordMm * machine_.axes[axis].steps_per_mm +
           std::max(lost, 0.0);
}

// How far `at` is from where the slides stand, in such distances: the largest of the motors'.
double Inspector::beside(const Point& at) const {
    double most = 0;
    for (std::size_t axis = 0; axis < kSlideCount; ++axis)
        most = std::max(most, std::abs(so_far_.built[axis] - at[axis]) / ball_steps(axis));
    return most;
}

// Moves `cursor` forward along its piece to the first place that is within `balls` of the slides;
// false when there is none.
bool Inspector::first_within(Cursor& cursor, double balls) const {
    const Piece& here = pieces_[cursor.piece];
    double low = cursor.share, high = 1;
    for (std::size_t axis = 0; axis < kSlideCount; ++axis) {
        const double length = here.to[axis] - here.from[axis];
        const double ahead = so_far_.built[axis] - here.from[axis];
        const double wide = balls * ball_steps(axis);
        if (length == 0) {
            if (std::abs(ahead) > wide) return false;
            continue;
        }
        const double one = (ahead - wide) / length, other = (ahead + wide) / length;
        low = std::max(low, std::min(one, other));
        high = std::min(high, std::max(one, other));
    }
    if (low > high) return false;
    cursor.share = low;
    return true;
}

// Looks on from the cursor for a place within `balls`, past nothing that the slides cannot have
// been near.
bool Inspector::find_within(Cursor& cursor, double balls) {
    while (cursor.piece < kLookAhead) {
        const Piece& here = piece(cursor.piece);
        const bool done = cursor.piece == 0 && cursor.share >= 1;  // a homing, maybe
        if (here.kind != AskedItem::Kind::move && !done) return false;
        if (first_within(cursor, balls)) return true;
        if (beside(here.to) > kPassBalls) return false;
        ++cursor.piece;
        cursor.share = 0;
    }
    return false;
}

void Inspector::follow_shaped(const Step& step) {
    Cursor cursor{0, so_far_.share, {}, {}, false};
    if (begins_at_rest(cursor, step)) return;
    const bool found = find_within(cursor, 1);
    if (!found && piece(cursor.piece).kind == AskedItem::Kind::home && begins_homing(cursor, step)) return;
    if (!found && piece(cursor.piece).kind == AskedItem::Kind::probe && begins_probing(cursor, step)) return;
    if (found) {
        so_far_.unexplained_run = 0;
        goes_on();
        drop_passed(cursor);
    } else {
        ++so_far_.unexplained_run;
        ++so_far_.findings.axes[step.axis].unexplained;
    }
    show_place();
    note_all(pieces_[place_].curved);
}

// The cursor stands at the end of what leads to a homing, or to a probing.
bool Inspector::begins_at_rest(Cursor& cursor, const Step& step) {
    const Piece& here = pieces_.front();
    if (so_far_.share < 1 && (moves_slides(here) || !filament_is_past(here))) return false;
    std::size_t next = 1;
    for (; piece(next).kind == AskedItem::Kind::move && !moves_slides(pieces_[next]); ++next)
        if (!filament_is_past(pieces_[next])) return false;
    const AskedItem::Kind kind = pieces_[next].kind;
    if (kind != AskedItem::Kind::home && kind != AskedItem::Kind::probe) return false;
    cursor = {next, 0, pieces_[next].from, {}, false};
    const bool begins =
        kind == AskedItem::Kind::home ? begins_homing(cursor, step) : begins_probing(cursor, step);
    if (!begins) cursor = {0, so_far_.share, {}, {}, false};
    return begins;
}

// Filament that moves alone moves the cursor: where the slides are near such a piece, and E is on
// it. Every other piece is led by the slides.
void Inspector::follow_extruder_shaped(int direction) {
    const double way = direction;
    const Step step{kExtruder, way, so_far_.built[kExtruder] - 0.5 * way, 0};
    Cursor cursor{0, so_far_.share, {}, {}, false};
    for (; cursor.piece < kLookAhead; ++cursor.piece, cursor.share = 0) {
        const Piece& here = piece(cursor.piece);
        const bool done = cursor.piece == 0 && cursor.share >= 1;
        if ((here.kind != AskedItem::Kind::move && !done) || beside(here.to) > kPassBalls) break;
        if (!filament_leads(here) || done) continue;
        const bool found = beside(here.to) <= 1 && creep(cursor, step);
        if (found) drop_passed(cursor);
        if (found || cursor.piece > 0) break;
    }
    show_place();
    note(kExtruder, std::abs(so_far_.built[kExtruder] - 0.5 * way - so_far_.at[kExtruder]),
         pieces_[place_].curved);
}

// The place to be shown and compared: from the cursor on as long as the slides come nearer.
void Inspector::show_place() {
    Cursor place{0, so_far_.share, {}, {}, false};
    while (place.piece < kLookAhead) {
        const Piece& here = pieces_[place.piece];
        const bool led = filament_leads(here);
        if (!led) place.share = nearest_share(here, place.share);
        if (!led && !is_at_end(here, place.share)) break;
        std::size_t next = place.piece + 1;
        bool pushed = place.share >= 1 || !led || filament_is_past(here);
        for (; piece(next).kind == AskedItem::Kind::move && filament_leads(pieces_[next]); ++next)
            pushed = pushed && filament_is_past(pieces_[next]);
        if (pieces_[next].kind != AskedItem::Kind::move || !pushed) break;
        if (nearest_share(pieces_[next], 0) <= 0) break;
        place.piece = next;
        place.share = 0;
    }
    place_ = place.piece;
    so_far_.at = point_on(pieces_[place_], place.share);
}

// A way that comes back on itself looks the same before filament moves alone and after. E knows.
bool Inspector::filament_is_past(const Piece& piece) const {
    const double way = piece.to[kExtruder] > piece.from[kExtruder] ? 1 : -1;
    return way * (so_far_.built[kExtruder] - piece.to[kExtruder]) >= -kWaitingSteps;
}

// Slides stand on whole steps, and so may never be seen at the very end.
bool Inspector::is_at_end(const Piece& piece, double share) {
    for (std::size_t axis = 0; axis < kSlideCount; ++axis)
        if (std::abs(piece.to[axis] - piece.from[axis]) * (1 - share) > kCleanSteps) return false;
    return true;
}

// At a rest filters have run out, and the slides stand on the path to a step.
void Inspector::rest_shaped() {
    Cursor cursor{0, so_far_.share, {}, {}, false};
    double finest = 1;
    for (std::size_t axis = 0; axis < kSlideCount; ++axis)
        finest = std::min(finest, kCleanSteps / ball_steps(axis));
    if (!find_within(cursor, finest)) return;
    const Piece& here = pieces_[cursor.piece];
    if (moves_slides(here)) cursor.share = nearest_share(here, cursor.share);
    drop_passed(cursor);
    so_far_.at = point_on(here, cursor.share);
}

}  // namespace qduino::twin
