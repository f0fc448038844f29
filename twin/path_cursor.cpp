#include "twin/path_cursor.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace qduino::twin {

PathCursor::PathCursor(const Machine& machine, ByteSource& source, const InspectionStart& start)
    : pieces_(machine, source, start), early_steps_(pieces_.space().gantry().is_linear() ? 0 : kTieSteps) {
    for (std::size_t axis = 0; axis < kAxisCount; ++axis)
        so_far_.built[axis] = static_cast<double>(start.built[axis]) - start.origin[axis];
    so_far_.at = pieces_.front().to;
}

// ---- looking ahead ------------------------------------------------------------------------------

bool PathCursor::pass_end(PathPlace& place, const MotorStep& step) const {
    place.at = pieces_[place.piece].to;
    place.share = 1;
    const bool curved = pieces_[place.piece].curved;  // its follower notes what is beside it
    for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
        const double before_step = so_far_.built[axis] - (axis == step.axis ? step.direction : 0.0);
        const double deviation = std::abs(before_step - place.at[axis]);
        if (!curved) place.worst[axis] = std::max(place.worst[axis], deviation);
        if (axis >= kSlideCount) continue;
        const double limit = step.limit_steps + allowance().slack_steps(axis);
        if (deviation <= limit) continue;
        if (deviation > limit + std::max(std::abs(before_step - so_far_.at[axis]), 0.5)) return false;
    }
    return true;
}

double PathCursor::nearest_share(const AskedPiece& here, double from) const {
    double along = 0;
    double length2 = 0;
    for (std::size_t axis = 0; axis < kSlideCount; ++axis) {
        const double way = (here.to[axis] - here.from[axis]) / steps_per_mm(axis);
        along += way * (so_far_.built[axis] - here.from[axis]) / steps_per_mm(axis);
        length2 += way * way;
    }
    return length2 > 0 ? std::clamp(along / length2, from, 1.0) : 1.0;
}

double PathCursor::ball_steps(std::size_t axis) const {
    const double lost = static_cast<double>(so_far_.unexplained_run) - 2 * static_cast<double>(kAwaySteps);
    return kAstraySteps + allowance().slack_steps(axis) + kChordMm * steps_per_mm(axis) + std::max(lost, 0.0);
}

double PathCursor::beside(const MotorPoint& at) const {
    double most = 0;
    for (std::size_t axis = 0; axis < kSlideCount; ++axis)
        most = std::max(most, std::abs(so_far_.built[axis] - at[axis]) / ball_steps(axis));
    return most;
}

// ---- going on -----------------------------------------------------------------------------------

void PathCursor::go_to(const PathPlace& place) {
    if (allowance().shaped()) {
        for (std::size_t i = 0; i < place.piece; ++i) passed_.push_back(pieces_[i]);
        while (passed_.size() > kAround) passed_.pop_front();
    }
    pieces_.drop(place.piece);
    shown_ = 0;
    so_far_.share = place.share;
    so_far_.at = place.at;
    note_worst_extruder();
}

void PathCursor::commit(const PathPlace& place) {
    go_to(place);
    for (std::size_t axis = 0; axis < kAxisCount; ++axis) note(axis, place.worst[axis], place.curved);
    note_all(place.curved);
}

void PathCursor::note_worst(std::size_t axis, double deviation_steps, bool curved) {
    double& worst = curved ? so_far_.worst_curved[axis] : so_far_.worst[axis];
    if (axis < kSlideCount && allowance().shaped()) {
        deviation_steps = std::min(deviation_steps, std::abs(off_nearest_piece()[axis]));
        if (deviation_steps <= worst) return;
    }
    worst = deviation_steps;
    AxisFindings& found = so_far_.findings.axes[axis];
    (curved ? found.worst_curve_line : found.worst_line) = shown().line;
}

// From the nearest of the pieces around the cursor to where the slides stand, in steps.
MotorPoint PathCursor::off_nearest_piece() {
    MotorPoint off{};
    double nearest_mm2 = std::numeric_limits<double>::infinity();
    const auto look = [&](const AskedPiece& piece) {
        if (piece.kind != AskedItem::Kind::move) return;
        const MotorPoint at = piece.at(nearest_share(piece, 0));
        double distance_mm2 = 0;
        for (std::size_t axis = 0; axis < kSlideCount; ++axis)
            distance_mm2 += std::pow((so_far_.built[axis] - at[axis]) / steps_per_mm(axis), 2);
        if (distance_mm2 >= nearest_mm2) return;
        nearest_mm2 = distance_mm2;
        for (std::size_t axis = 0; axis < kSlideCount; ++axis) off[axis] = so_far_.built[axis] - at[axis];
    };
    for (const AskedPiece& piece : passed_) look(piece);
    for (std::size_t i = 0; i < kLookAhead && pieces_.piece(i).kind != AskedItem::Kind::end; ++i) {
        // What is behind a G29 that is still to come is not read: the bed is not yet known.
        if (pieces_[i].kind == AskedItem::Kind::probe && i > 0) break;
        look(pieces_[i]);
        if (i >= shown_ + kAround && beside(pieces_[i].to) > kPassBalls) break;
    }
    return off;
}

bool PathCursor::pass_rest() {
    const MotorStep nobody{kAxisCount, 0, 0, kAstraySteps};
    PathPlace place = this->place();
    for (; place.piece < kLookAhead; ++place.piece, place.share = 0) {
        const AskedPiece& here = pieces_.piece(place.piece);
        place.curved = place.curved || here.curved;
        if (here.kind == AskedItem::Kind::end) break;
        // A homing that never began.
        const bool waits = here.kind == AskedItem::Kind::home || here.kind == AskedItem::Kind::probe;
        if (waits && place.piece > 0) return false;
        if (here.kind != AskedItem::Kind::move) continue;
        if (allowance().shaped() ? beside(here.to) > kPassBalls : !pass_end(place, nobody)) return false;
        place.at = here.to;
    }
    if (place.piece >= kLookAhead) return false;
    place.share = 1;
    commit(place);
    return true;
}

// ---- going back ---------------------------------------------------------------------------------

void PathCursor::stand_at(const Comparison& then, const std::deque<AskedPiece>& pieces, std::uint64_t next) {
    pieces_.go_back_to(pieces, next);
    so_far_ = then;
    shown_ = 0;
    passed_.clear();
}

void PathCursor::take_back(const PathCursor& then) {
    pieces_.go_back_to(then.pieces_.all(), then.pieces_.kept().next());
    so_far_ = then.so_far_;
    shown_ = then.shown_;
    passed_ = then.passed_;
}

void PathCursor::stretch(const AskedPath::Stretch& by) {
    pieces_.stretch(by, so_far_.share);
    so_far_.at[kExtruder] = pieces_.front().at(so_far_.share)[kExtruder];
    const double before = worst_extruder_before(by.line);
    constexpr double kNothing = 1e-9;
    if (so_far_.at[kExtruder] > by.from_mm * steps_per_mm(kExtruder) + kNothing)
        so_far_.worst[kExtruder] = std::max(before, so_far_.off(kExtruder));
}

// The worst deviation of E, in steps, when the cursor came to that line.
double PathCursor::worst_extruder_before(std::uint64_t line) const {
    const auto then = std::find_if(worst_extruder_.rbegin(), worst_extruder_.rend(),
                                   [&](const WorstExtruder& noted) { return noted.line <= line; });
    return then == worst_extruder_.rend() ? so_far_.worst[kExtruder] : then->steps;
}

void PathCursor::note_worst_extruder() {
    const std::uint64_t line = pieces_.front().line;
    if (!worst_extruder_.empty() && worst_extruder_.back().line == line) return;
    worst_extruder_.push_back({line, so_far_.worst[kExtruder]});
    if (worst_extruder_.size() > AskedPath::kLineEnds) worst_extruder_.pop_front();
}

}  // namespace qduino::twin
