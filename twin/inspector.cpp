#include "twin/inspector.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <optional>

namespace qduino::twin {
namespace {

// A path that ends this near to a half step may have been rounded either way: both are right.
constexpr double kTieSteps = 0.01;
constexpr std::size_t kNoAxis = kAxisCount;

}  // namespace

InspectionStart InspectionStart::at_power_on(const Machine& machine, const Counts& built,
                                             const std::array<bool, kSlideCount>& pressed) {
    InspectionStart start;
    start.built = built;
    start.asked_mm = home_of(machine);
    const Position motors = Gantry{machine}.motors_at(start.asked_mm);
    for (std::size_t axis = 0; axis < kAxisCount; ++axis)
        start.origin[axis] = static_cast<double>(built[axis]) -
                             std::floor(motors[axis] * machine.axes[axis].steps_per_mm + 0.5);
    start.pressed = pressed;
    start.bed = AskedBed{machine};
    for (const KnownBedSpec& known : machine.known_beds)
        start.maps.insert_or_assign(start.bed.know(known.name, known.in_force), BedMap{known});
    return start;
}

Inspector::Inspector(const Machine& machine, ByteSource& source, const InspectionStart& start)
    : machine_(machine),
      gantry_(machine),
      asked_(source, start.asked_mm, machine, Compensation{machine}, start.bed),
      maps_(start.maps),
      last_map_(start.bed.maps()),
      read_to_(start.asked_mm),
      chord_error_mm_(kChordSteps / std::max({machine.axes[0].steps_per_mm, machine.axes[1].steps_per_mm,
                                              machine.axes[2].steps_per_mm})),
      early_steps_(gantry_.is_linear() ? 0 : kTieSteps),
      origin_(start.origin),
      position_(start.built),
      pressed_(start.pressed) {
    for (std::size_t axis = 0; axis < kAxisCount; ++axis)
        so_far_.built[axis] = static_cast<double>(position_[axis]) - origin_[axis];
    so_far_.at = place_at_start(start);
    widen_turn(start.asked_mm);
    // A piece of no length: the place to start from.
    pieces_.push_back({AskedItem::Kind::move, 0, false, 0, so_far_.at, so_far_.at, 0});
    widen_reach();
}

// Where the path has it, or as the switches have left it: their places are not corrected.
Inspector::Point Inspector::place_at_start(const InspectionStart& start) const {
    const Point by_path = to_steps(corrected(start.asked_mm, start.bed.now()));
    const Point by_switches = to_steps(start.asked_mm);
    const auto off = [&](const Point& place) {
        double most = 0;
        for (std::size_t axis = 0; axis < kSlideCount; ++axis)
            most = std::max(most, std::abs(so_far_.built[axis] - place[axis]));
        return most;
    };
    return off(by_switches) < off(by_path) ? by_switches : by_path;
}

Inspector::Point Inspector::to_steps(const Position& mm) const {
    Point steps = gantry_.motors_at(mm);
    for (std::size_t axis = 0; axis < kAxisCount; ++axis) steps[axis] *= machine_.axes[axis].steps_per_mm;
    return steps;
}

Position Inspector::to_mm(const Point& steps) const {
    Position motors = steps;
    for (std::size_t axis = 0; axis < kAxisCount; ++axis) motors[axis] /= machine_.axes[axis].steps_per_mm;
    return gantry_.nozzle_at(motors);
}

/// Where the motors' steps put the nozzle.
Position Inspector::built_mm() const {
    Point steps;
    for (std::size_t axis = 0; axis < kAxisCount; ++axis)
        steps[axis] = static_cast<double>(position_[axis]) - origin_[axis];
    return to_mm(steps);
}

/// Where the nozzle must be for the part to be as asked.
Position Inspector::corrected(const Position& asked, const AskedCorrection& by) const {
    Position at = asked;
    const auto [xy, xz, yz] = by.skew;
    at[1] -= yz * asked[2];
    at[0] -= xy * asked[1] + (xz - xy * yz) * asked[2];
    const auto map = maps_.find(by.map);
    if (!by.follows_bed || map == maps_.end()) return at;
    at[2] += fade_at(asked[2], by.fade_end_mm) * map->second.height_at(at[0], at[1]);
    return at;
}

// The share of the bed's height that is followed so far above it.
double Inspector::fade_at(double asked_z_mm, double fade_end_mm) const {
    const double above = asked_z_mm - machine_.grid.fade_start_mm;
    const double span = fade_end_mm - machine_.grid.fade_start_mm;
    return fade_end_mm > 0 && above > 0 ? std::max(1 - above / span, 0.0) : 1.0;
}

double Inspector::lift_by_bed(const Position& nozzle) const {
    const Piece& here = pieces_.front();
    const auto map = maps_.find(here.map);
    if (here.map == 0 || map == maps_.end()) return 0;
    const double height = map->second.height_at(nozzle[0], nozzle[1]);
    // Solves asked + fade(asked)·height = built: each round leaves height / span of the error.
    double lift = height;
    for (int i = 0; i < 6; ++i) lift = fade_at(nozzle[2] - lift, here.fade_end_mm) * height;
    return lift;
}

const Inspector::Piece& Inspector::piece(std::size_t index) {
    while (pieces_.size() <= index && pieces_.back().kind != AskedItem::Kind::end) read_item();
    return pieces_[std::min(index, pieces_.size() - 1)];
}

// The next item of the path, in pieces that are straight for every motor. A correction that has
// changed first moves the nozzle where it stands.
void Inspector::read_item() {
    const AskedItem item = asked_.next();
    if (asked_.compensation().changes() != filters_seen_) widen_reach();
    const Point last = pieces_.back().to;
    if (item.kind == AskedItem::Kind::move) {
        const Point begin = to_steps(corrected(read_to_, item.correction));
        for (std::size_t axis = 0; axis < kSlideCount; ++axis) {
            if (std::abs(begin[axis] - last[axis]) < kTieSteps) continue;
            push_piece({item.kind, 0, false, item.line, last, begin, 0});
            break;
        }
        push_way(item);
    } else {
        const bool ends = item.kind == AskedItem::Kind::end;
        push_piece(
            {item.kind, item.homed, false, item.line, last, ends ? last : to_steps(home_from(item)), 0});
    }
    read_to_ = item.to;
}

void Inspector::push_way(const AskedItem& item) {
    const Position& from = read_to_;
    const double way_mm = std::hypot(item.to[0] - from[0], item.to[1] - from[1]);
    const bool bent = item.correction.follows_bed && maps_.contains(item.correction.map) && way_mm > 0;
    widen_turn(item.to);
    int count = gantry_.pieces_of(from, item.to, chord_error_mm_);
    if (bent) count = std::max(count, static_cast<int>(std::ceil(way_mm / kBedPieceMm)));
    for (int i = 1; i <= count; ++i) {
        Position to = item.to;
        for (std::size_t axis = 0; axis < kAxisCount && i < count; ++axis)
            to[axis] = from[axis] + (item.to[axis] - from[axis]) * i / count;
        const Point end = to_steps(corrected(to, item.correction));
        push_piece({item.kind, 0, item.curved || bent, item.line, pieces_.back().to, end, item.advance_s,
                    item.correction.follows_bed ? item.correction.map : 0, item.correction.fade_end_mm});
    }
}

void Inspector::push_piece(const Piece& piece) {
    pieces_.push_back(piece);
    ++pieces_read_;
    if (!remembered_.empty()) read_since_.push_back(piece);
}

// Where the nozzle is after a G28 or a G29: its switches' places are the machine's, not corrected.
Position Inspector::home_from(const AskedItem& item) const {
    if (item.kind == AskedItem::Kind::probe || !item.correction.active()) return item.to;
    Position at = to_mm(pieces_.back().to);
    for (std::size_t axis = 0; axis < kSlideCount; ++axis)
        if ((item.homed >> axis & 1u) != 0) at[axis] = item.to[axis];
    return at;
}

void Inspector::widen_reach() {
    filters_seen_ = asked_.compensation().changes();
    reach_mm_.widen(asked_.compensation().reach(machine_));
    const Position reach = gantry_.reach_of(reach_mm_.mm);
    for (std::size_t axis = 0; axis < kAxisCount; ++axis)
        reach_steps_[axis] = reach[axis] * machine_.axes[axis].steps_per_mm;
    // Z has no shaper: it is where the plan is.
    const Position plan = gantry_.reach_of({reach_mm_.mm[0], reach_mm_.mm[1], 0, 0});
    for (std::size_t axis = 0; axis < kSlideCount; ++axis)
        plan_steps_[axis] = plan[axis] * machine_.axes[axis].steps_per_mm;
}

void Inspector::widen_turn(const Position& nozzle) {
    for (std::size_t axis = 0; axis < kSlideCount; ++axis)
        turn_mm_[axis] =
            std::max(turn_mm_[axis], left_out_at_turn_mm(machine_, axis, gantry_.rate_of(axis, nozzle)));
}

// On top of kAstraySteps.
double Inspector::slack_steps(std::size_t axis) const {
    return plan_steps_[axis] + std::max(turn_mm_[axis] * machine_.axes[axis].steps_per_mm - kTurnSteps, 0.0);
}

// At its step the filament stands on the half-step before.
void Inspector::watch_advance(int direction) {
    const Piece& here = pieces_[place_];
    const bool sideways = here.from[0] != here.to[0] || here.from[1] != here.to[1];
    if (direction < 0 || here.kind != AskedItem::Kind::move || !sideways ||
        here.to[kExtruder] <= here.from[kExtruder])
        return advance_.interrupt();
    const double steps_per_mm = machine_.axes[kExtruder].steps_per_mm;
    advance_.on_push(now_, so_far_.at[kExtruder] / steps_per_mm,
                     (so_far_.built[kExtruder] - 0.5) / steps_per_mm, here.advance_s,
                     asked_.compensation().smooth_s());
}

// ---- input from the pins ------------------------------------------------------------------------

void Inspector::on_step(const StepSeen& step) {
    const std::size_t axis = step.axis;
    const std::uint8_t moved = gantry_.slides_of(axis);
    if (homing_.active()) end_homing(homing_.settle(step.at, moved));
    if (homing_.active() && moved != 0 && (homing_.pending() & moved) == 0) take_for_excursion();
    if (probing_.active) probe_step(step.at);
    if (step.at - now_ >= kRest) rest();
    since_rest_ += axis < 2 ? 1 : 0;
    position_[axis] = step.position;
    now_ = step.at;
    ++so_far_.findings.axes[axis].steps;
    if (away_) {
        ++so_far_.findings.axes[axis].unexplained;
        return;
    }
    if ((homing_.pending() & moved) != 0 || (probing_.active && moved != 0)) return;
    so_far_.built[axis] += step.direction;
    if (axis == kExtruder) {
        so_far_.pushed_steps += step.direction > 0 ? 1 : 0;
        so_far_.net_steps += step.direction;
        watch_advance(step.direction);
        shaped() ? follow_extruder_shaped(step.direction) : follow_extruder(step.direction);
    } else {
        follow(axis, step.direction);
    }
    away_ = leaves(axis);
}

void Inspector::on_endstop(Instant at, int axis, bool pressed) {
    now_ = at;
    pressed_[axis] = pressed;
    if (homing_.active()) homing_.on_endstop(at, axis, pressed);
}

void Inspector::on_probe(Instant at) {
    now_ = std::max(now_, at);
    probing_.touches = probing_.active;
}

// ---- measuring the bed --------------------------------------------------------------------------

// The cursor stands at a G29: any slide that moves belongs to it.
bool Inspector::begins_probing(Cursor& cursor, const Step& step) {
    if (gantry_.slides_of(step.axis) == 0) return false;
    so_far_.built[step.axis] -= step.direction;
    commit(cursor);
    so_far_.at = pieces_.front().to;
    so_far_.share = 1;
    passed_.clear();
    remembered_.clear();
    read_since_.clear();
    probing_ = {true, false, ++last_map_};
    maps_.insert_or_assign(probing_.map, BedMap{machine_.grid});
    return true;
}

// Before a step is counted: has the nozzle rested on a point, or at the end?
void Inspector::probe_step(Instant at) {
    if (at - now_ < kRest) return;
    if (probing_.touches) {
        const Position nozzle = built_mm();
        const ProbeSpec& probe = machine_.probe;
        maps_.at(probing_.map)
            .touch(nozzle[0] + probe.x_offset_mm, nozzle[1] + probe.y_offset_mm,
                   nozzle[2] - probe.trigger_height_mm);
        probing_.touches = false;
    }
    if (has_probed(at)) end_probing();
}

bool Inspector::has_probed(Instant at) const {
    if (at - now_ < kRest || !maps_.at(probing_.map).complete()) return false;
    for (std::size_t axis = 0; axis < kSlideCount; ++axis) {
        const double built = static_cast<double>(position_[axis]) - origin_[axis];
        if (std::abs(built - so_far_.at[axis]) > 0.5 + kTieSteps) return false;
    }
    return true;
}

void Inspector::end_probing() {
    probing_.active = false;
    for (std::size_t axis = 0; axis < kSlideCount; ++axis)
        so_far_.built[axis] = static_cast<double>(position_[axis]) - origin_[axis];
}

void Inspector::begin_homing() {
    passed_.clear();
    // What else was remembered is useless: zero will be elsewhere.
    while (remembered_.size() > (origin_at_rest_ ? 1 : 0)) forget_oldest();
    if (!origin_at_rest_) read_since_.clear();
    const std::uint8_t slides = pieces_.front().homed;
    const std::uint8_t motors = gantry_.motors_of(slides);
    for (std::size_t motor = 0; motor < kSlideCount; ++motor)
        if ((motors >> motor & 1u) != 0)
            so_far_.built[motor] = so_far_.at[motor];  // nothing is compared until it is home
    homing_.begin(now_, slides, pressed_);
}

// What began as a homing was an excursion: the head has left the path at the rest before.
void Inspector::take_for_excursion() {
    if (!origin_at_rest_) return;
    origin_ = *origin_at_rest_;
    origin_at_rest_.reset();
    homing_ = HomingWatch{};
    away_ = true;
    rest();  // it may be back already
}

// The slides of `homed` stand at their switches, and the others where they stood.
void Inspector::end_homing(std::uint8_t homed) {
    if (homed == 0) return;
    if (!homing_.active()) {
        origin_at_rest_.reset();
        remembered_.clear();
        read_since_.clear();
    }
    Position slides = gantry_.is_linear() ? built_mm() : Position{};
    for (std::size_t slide = 0; slide < kSlideCount; ++slide) {
        if ((homed >> slide & 1u) == 0) continue;
        slides[slide] = machine_.axes[slide].home_mm;
        so_far_.findings.axes[slide].homed = true;
        homed_at_[slide] = gantry_.slide_steps(slide, position_);
    }
    // A delta's slides are its motors' own.
    const Position motors = gantry_.is_linear() ? gantry_.motors_at(slides) : slides;
    const std::uint8_t moved = gantry_.motors_of(homed);
    for (std::size_t motor = 0; motor < kSlideCount; ++motor) {
        if ((moved >> motor & 1u) == 0) continue;
        so_far_.built[motor] = std::floor(motors[motor] * machine_.axes[motor].steps_per_mm + 0.5);
        origin_[motor] = static_cast<double>(position_[motor]) - so_far_.built[motor];
    }
}

// ---- away from the path, and back ---------------------------------------------------------------

// Nothing has moved for kRest. Checks whether the head is back where it left the path, and whether
// it is on the path at all.
void Inspector::rest() {
    since_rest_ = 0;
    if (homing_.active() || probing_.active) return;
    if (shaped() && !away_) rest_shaped();
    for (std::size_t i = remembered_.size(); i-- > 0;) {
        if (!stands_at(remembered_[i])) continue;
        if (!is_clean_since(remembered_[i])) return come_back(i);
        break;
    }
    if (is_on_path()) {
        remember();
    } else if (!remembered_.empty()) {
        note_near_miss();
    }
}

bool Inspector::stands_at(const Remembered& then) const {
    return std::equal(position_.begin(), position_.begin() + kSlideCount, then.position.begin());
}

bool Inspector::is_on_path() const {
    if (away_ || so_far_.unexplained_run != 0) return false;
    for (std::size_t axis = 0; axis < kSlideCount; ++axis)
        if (std::abs(so_far_.built[axis] - so_far_.at[axis]) > kCleanSteps) return false;
    return std::abs(so_far_.built[kExtruder] - so_far_.at[kExtruder]) <=
           kCleanExtruderSteps + reach_steps_[kExtruder];
}

// True when the path has explained every step since.
bool Inspector::is_clean_since(const Remembered& then) const {
    if (away_) return false;
    for (std::size_t axis = 0; axis < kSlideCount; ++axis) {
        if (so_far_.findings.axes[axis].unexplained != then.so_far.findings.axes[axis].unexplained)
            return false;
    }
    return std::max(so_far_.worst[kExtruder], so_far_.worst_curved[kExtruder]) <=
           std::max({then.so_far.worst[kExtruder], then.so_far.worst_curved[kExtruder],
                     kCleanExtruderSteps + reach_steps_[kExtruder]});
}

void Inspector::remember() {
    remembered_.push_back({so_far_, pieces_, position_, pieces_read_});
    if (remembered_.size() > kRests) forget_oldest();
}

void Inspector::forget_oldest() {
    const std::uint64_t from = remembered_.front().pieces_read;
    remembered_.pop_front();
    const std::uint64_t to = remembered_.empty() ? pieces_read_ : remembered_.front().pieces_read;
    read_since_.erase(read_since_.begin(), read_since_.begin() + static_cast<std::ptrdiff_t>(to - from));
}

// The excursion seems over. It is counted when the path goes on: until then the head may only rest
// where it left.
void Inspector::come_back(std::size_t which) {
    const Remembered& then = remembered_[which];
    const auto known = static_cast<std::ptrdiff_t>(then.pieces_read - remembered_.front().pieces_read);
    pieces_ = then.pieces;
    place_ = 0;
    pieces_.insert(pieces_.end(), read_since_.begin() + known, read_since_.end());
    const Findings seen = so_far_.findings;
    so_far_ = then.so_far;
    for (std::size_t axis = 0; axis < kAxisCount; ++axis)
        so_far_.findings.axes[axis].steps = seen.axes[axis].steps;
    // E counts on from where it left.
    const double origin = static_cast<double>(position_[kExtruder]) - so_far_.built[kExtruder];
    pushed_away_ += std::llround(origin - origin_[kExtruder]);
    origin_[kExtruder] = origin;
    passed_.clear();
    remembered_.resize(which + 1);
    away_ = false;
    counted_ = false;
}

// The head has left the path at the last rest, and does not come back: a machine takes it out of
// the part when the job is over. Where it went is no part of the print, if the path ends there.
void Inspector::take_leave() {
    const bool left =
        !homing_.active() && !probing_.active && !remembered_.empty() && !is_clean_since(remembered_.back());
    if (!left) return;
    const Inspector before = *this;
    position_ = remembered_.back().position;
    come_back(remembered_.size() - 1);
    if (pass_rest()) return;
    // It does not: the comparison stands as it did, but for what has been read of the file
    // meanwhile.
    const auto read = static_cast<std::ptrdiff_t>(pieces_read_ - before.pieces_read_);
    pieces_ = before.pieces_;
    pieces_.insert(pieces_.end(), read_since_.end() - read, read_since_.end());
    so_far_ = before.so_far_;
    position_ = before.position_;
    origin_ = before.origin_;
    pushed_away_ = before.pushed_away_;
    passed_ = before.passed_;
    remembered_ = before.remembered_;
    place_ = before.place_;
    away_ = before.away_;
    counted_ = before.counted_;
}

// At rest beside the place where it left: keeps the distance for the report.
void Inspector::note_near_miss() {
    std::array<std::int64_t, kSlideCount> beside{};
    for (std::size_t axis = 0; axis < kSlideCount; ++axis) {
        beside[axis] = position_[axis] - remembered_.back().position[axis];
        if (std::abs(beside[axis]) > kNearSteps) return;
    }
    so_far_.findings.beside_steps = beside;
}

// The path explains a step again.
void Inspector::goes_on() {
    if (!counted_) ++so_far_.findings.excursions;
    counted_ = true;
    // No head leaves the path from so far behind: what is remembered is useless by now, and would
    // grow.
    while (read_since_.size() > 2 * kLookAhead) forget_oldest();
}

bool Inspector::leaves(std::size_t axis) const {
    if (remembered_.empty() || homing_.active() || since_rest_ > kAwayWithinSteps) return false;
    if (axis != kExtruder) return so_far_.unexplained_run >= kAwaySteps;
    return stands_at(remembered_.back()) && std::abs(so_far_.built[kExtruder] - so_far_.at[kExtruder]) >=
                                                static_cast<double>(kAwaySteps) + reach_steps_[kExtruder];
}

// ---- following the path -------------------------------------------------------------------------

void Inspector::follow(std::size_t axis, int direction) {
    const double way = direction;
    const Step step{axis, way, so_far_.built[axis] - 0.5 * way,
                    kAstraySteps + static_cast<double>(so_far_.unexplained_run)};
    if (shaped()) return follow_shaped(step);
    // The path has been beyond the step's boundary: the step is late. On the boundary itself, a
    // step the other way may just have put the cursor there, so the path ahead is asked first.
    // On a curve crossings say nothing.
    const bool curved = pieces_.front().curved;
    const double beyond = way * (so_far_.at[axis] - step.boundary);
    const bool ahead = curved || beyond <= kTieSteps + early_steps_;
    const bool found = ahead && (advance_in_piece(step) || (so_far_.unexplained_run < kGiveUp && walk(step)));
    if (found || (!curved && beyond >= -kTieSteps)) {
        if (!found) note(axis, std::abs(beyond) + 0.5, pieces_.front().curved);
        so_far_.unexplained_run = 0;
        if (found) goes_on();
        return;
    }
    ++so_far_.unexplained_run;
    ++so_far_.findings.axes[axis].unexplained;
    note(axis, std::abs(so_far_.built[axis] - so_far_.at[axis]), pieces_.front().curved);
}

// Nearly every step ends here: the boundary lies on the piece that the cursor is on.
bool Inspector::advance_in_piece(const Step& step) {
    const Piece& here = pieces_.front();
    if (here.kind != AskedItem::Kind::move || here.curved) return false;
    Cursor cursor{0, so_far_.share, so_far_.at, {}, false};
    if (step.direction * (here.to[step.axis] - step.boundary) < 0 || !creep(cursor, step)) return false;
    if (!others_near(cursor, step)) return false;
    so_far_.share = cursor.share;
    so_far_.at = cursor.at;
    note_all(false);
    return true;
}

Inspector::Point Inspector::point_on(const Piece& piece, double share) {
    if (share >= 1) return piece.to;
    Point point;
    for (std::size_t axis = 0; axis < kAxisCount; ++axis)
        point[axis] = piece.from[axis] + share * (piece.to[axis] - piece.from[axis]);
    return point;
}

// Moves `cursor` along its piece to the first place that explains the step; false when none does.
bool Inspector::creep(Cursor& cursor, const Step& step) const {
    const Piece& here = pieces_[cursor.piece];
    const double beyond = step.direction * (here.to[step.axis] - step.boundary);
    const double length = here.to[step.axis] - here.from[step.axis];
    if (beyond < -kTieSteps || step.direction * length <= 0) return false;
    const double first = step.boundary - step.direction * early_steps_;
    cursor.share = std::clamp((first - here.from[step.axis]) / length, cursor.share, 1.0);
    cursor.at = point_on(here, cursor.share);
    return true;
}

// True when this move of the cursor leaves no other slide further behind (or ahead) than the limit
// allows.
bool Inspector::others_near(const Cursor& cursor, const Step& step) const {
    for (std::size_t axis = 0; axis < kSlideCount; ++axis) {
        const double deviation = std::abs(so_far_.built[axis] - cursor.at[axis]);
        const double limit = step.limit_steps + slack_steps(axis);
        if (deviation <= limit || axis == step.axis) continue;
        if (deviation > limit + std::max(std::abs(so_far_.built[axis] - so_far_.at[axis]), 0.5)) return false;
    }
    return true;
}

// Moves `cursor` to the end of its piece. False when that leaves a slide too far from its position.
bool Inspector::pass_end(Cursor& cursor, const Step& step) const {
    cursor.at = pieces_[cursor.piece].to;
    cursor.share = 1;
    const bool curved = pieces_[cursor.piece].curved;  // commit_on_curve() notes what is beside it
    for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
        const double before_step = so_far_.built[axis] - (axis == step.axis ? step.direction : 0.0);
        const double deviation = std::abs(before_step - cursor.at[axis]);
        if (!curved) cursor.worst[axis] = std::max(cursor.worst[axis], deviation);
        if (axis >= kSlideCount) continue;
        const double limit = step.limit_steps + slack_steps(axis);
        if (deviation <= limit) continue;
        if (deviation > limit + std::max(std::abs(before_step - so_far_.at[axis]), 0.5)) return false;
    }
    return true;
}

// Looks for the step's boundary on the pieces ahead, or for the place of a curve that the step
// leads to, and meanwhile for a homing that would explain the step. At the end of a curve a step
// beyond its last place may be the first one of what follows.
bool Inspector::walk(const Step& step) {
    Cursor cursor{0, so_far_.share, so_far_.at, {}, pieces_.front().curved};
    std::optional<Cursor> on_curve;  // to take if nothing behind the curve explains the step
    while (cursor.piece < kLookAhead) {
        const Piece& here = pieces_[cursor.piece];
        if (here.curved) {
            const bool goes_on = project(cursor);
            const bool reached =
                cursor.share < 1 || step.direction * (cursor.at[step.axis] - step.boundary) >= -kTieSteps;
            if (!goes_on && reached && is_near_curve(cursor, kOnCurveSteps))
                return commit_on_curve(cursor), true;
            if (is_near_curve(cursor, step.limit_steps)) on_curve = cursor;
            if (!pass_end(cursor, step)) break;
        } else if (cursor.share < 1 || cursor.piece == 0) {
            if (here.kind == AskedItem::Kind::move && creep(cursor, step)) {
                if (!others_near(cursor, step)) break;
                return commit(cursor), true;
            }
            if (!pass_end(cursor, step)) break;
        }
        const Piece& next = piece(++cursor.piece);
        cursor.share = 0;
        cursor.curved = cursor.curved || next.curved;
        if (next.kind == AskedItem::Kind::end) break;
        if (next.kind == AskedItem::Kind::home) {
            if (begins_homing(cursor, step)) return true;
            break;
        }
        if (next.kind == AskedItem::Kind::probe) {
            if (begins_probing(cursor, step)) return true;
            break;
        }
    }
    if (on_curve) commit_on_curve(*on_curve);
    return on_curve.has_value();
}

// Does the step bring a slide of its own from its switch, which is open? No homing begins so.
bool Inspector::goes_from_open_switch(const Step& step) const {
    if (gantry_.slides_of(step.axis) != 1u << step.axis || pressed_[step.axis]) return false;
    return (step.direction > 0) == machine_.axes[step.axis].trigger_at_minimum;
}

// Did the step begin where the head rested then?
bool Inspector::stands_at_but_for(const Remembered& then, const Step& step) const {
    auto before = position_;
    before[step.axis] -= step.direction > 0 ? 1 : -1;
    return std::equal(before.begin(), before.begin() + kSlideCount, then.position.begin());
}

// The cursor stands at a G28: does the step belong to it?
bool Inspector::begins_homing(Cursor& cursor, const Step& step) {
    if ((pieces_[cursor.piece].homed & gantry_.slides_of(step.axis)) == 0) return false;
    if (goes_from_open_switch(step)) return false;
    so_far_.built[step.axis] -= step.direction;  // this step is homing's own
    origin_at_rest_.reset();
    if (!remembered_.empty() && stands_at_but_for(remembered_.back(), step)) origin_at_rest_ = origin_;
    commit(cursor);
    so_far_.at = pieces_.front().to;
    so_far_.share = 1;
    begin_homing();
    return true;
}

// The extruder moves the cursor at most to where a slide is due to step.
void Inspector::follow_extruder(int direction) {
    const double way = direction;
    const Step step{kExtruder, way, so_far_.built[kExtruder] - 0.5 * way, 0};
    note(kExtruder, std::abs(so_far_.at[kExtruder] - (so_far_.built[kExtruder] - way)),
         pieces_.front().curved);
    Cursor cursor{0, so_far_.share, so_far_.at, {}, pieces_.front().curved};
    const bool behind =
        way * (step.boundary - so_far_.at[kExtruder]) > kWaitingSteps + reach_steps_[kExtruder];
    bool found = way * (so_far_.at[kExtruder] - step.boundary) > kTieSteps;
    while (!found && cursor.piece < kLookAhead) {
        const Piece& here = pieces_[cursor.piece];
        if (here.kind == AskedItem::Kind::move) {
            const double reach = slides_reach(cursor, behind);
            Cursor crossing = cursor;
            found = creep(crossing, step) && crossing.share <= reach;
            if (found) {
                cursor = crossing;
            } else {
                cursor.share = reach;
                cursor.at = point_on(here, reach);
            }
            if (found || reach < 1) break;
        }
        cursor.worst[kExtruder] = std::max(cursor.worst[kExtruder],
                                           std::abs(so_far_.built[kExtruder] - way - cursor.at[kExtruder]));
        const Piece& next = piece(cursor.piece + 1);
        if (next.kind != AskedItem::Kind::move) break;
        ++cursor.piece;
        cursor.share = 0;
        cursor.curved = cursor.curved || next.curved;
    }
    commit(cursor);
}

// Share of the cursor's piece up to which every slide stays within half a step of its position; not
// less than the cursor's. `behind`: E waits, so no step is waited for that a slide may leave out.
double Inspector::slides_reach(const Cursor& cursor, bool behind) {
    double reach = 1;
    for (std::size_t axis = 0; axis < kSlideCount; ++axis) {
        const Piece& here = pieces_[cursor.piece];
        const double length = here.to[axis] - here.from[axis];
        if (length == 0) continue;
        const double way = length > 0 ? 1 : -1;
        const double edge = so_far_.built[axis] + 0.5 * way;
        const double share = (edge - here.from[axis]) / length;
        if (share >= reach || (behind && turns_back(axis, cursor.piece, edge, way))) continue;
        reach = share;
    }
    return std::max(reach, cursor.share);
}

// The path goes beyond the slide's `edge` by no more than may be left out, and comes back.
bool Inspector::turns_back(std::size_t axis, std::size_t index, double edge, double way) {
    const double most = turn_mm_[axis] * machine_.axes[axis].steps_per_mm;
    for (std::size_t i = index; i < index + kAround; ++i) {
        const Piece& there = piece(i);
        const double beyond = way * (there.to[axis] - edge);
        if (there.kind != AskedItem::Kind::move || beyond > most) return false;
        if (beyond <= 0) return true;
    }
    return false;
}

void Inspector::drop_passed(const Cursor& cursor) {
    if (shaped()) {
        passed_.insert(passed_.end(), pieces_.begin(),
                       pieces_.begin() + static_cast<std::ptrdiff_t>(cursor.piece));
        while (passed_.size() > kAround) passed_.pop_front();
    }
    pieces_.erase(pieces_.begin(), pieces_.begin() + static_cast<std::ptrdiff_t>(cursor.piece));
    place_ = 0;
    so_far_.share = cursor.share;
    so_far_.at = cursor.at;
    note_worst_extruder();
}

void Inspector::commit(const Cursor& cursor) {
    drop_passed(cursor);
    for (std::size_t axis = 0; axis < kAxisCount; ++axis) note(axis, cursor.worst[axis], cursor.curved);
    note_all(cursor.curved);
}

void Inspector::note(std::size_t axis, double deviation_steps, bool curved) {
    double& worst = curved ? so_far_.worst_curved[axis] : so_far_.worst[axis];
    if (deviation_steps <= worst) return;
    if (axis < kSlideCount && shaped()) {
        deviation_steps = std::min(deviation_steps, std::abs(off_nearest_piece()[axis]));
        if (deviation_steps <= worst) return;
    }
    worst = deviation_steps;
    AxisFindings& found = so_far_.findings.axes[axis];
    (curved ? found.worst_curve_line : found.worst_line) = pieces_[place_].line;
}

// From the nearest of the pieces around the cursor to where the slides stand, in steps.
Inspector::Point Inspector::off_nearest_piece() {
    Point off{};
    double nearest_mm2 = std::numeric_limits<double>::infinity();
    const auto look = [&](const Piece& piece) {
        if (piece.kind != AskedItem::Kind::move) return;
        const Point at = point_on(piece, nearest_share(piece, 0));
        double distance_mm2 = 0;
        for (std::size_t axis = 0; axis < kSlideCount; ++axis)
            distance_mm2 += std::pow((so_far_.built[axis] - at[axis]) / machine_.axes[axis].steps_per_mm, 2);
        if (distance_mm2 >= nearest_mm2) return;
        nearest_mm2 = distance_mm2;
        for (std::size_t axis = 0; axis < kSlideCount; ++axis) off[axis] = so_far_.built[axis] - at[axis];
    };
    for (const Piece& piece : passed_) look(piece);
    for (std::size_t i = 0; i < kLookAhead && piece(i).kind != AskedItem::Kind::end; ++i) {
        // What is behind a G29 that is still to come is not read: the bed is not yet known.
        if (pieces_[i].kind == AskedItem::Kind::probe && i > 0) break;
        look(pieces_[i]);
        if (i >= place_ + kAround && beside(pieces_[i].to) > kPassBalls) break;
    }
    return off;
}

// On a curve, what the slides are beside it is noted where they step: commit_on_curve().
void Inspector::note_all(bool curved) {
    for (std::size_t axis = curved ? kExtruder : 0; axis < kAxisCount; ++axis)
        note(axis, std::abs(so_far_.built[axis] - so_far_.at[axis]), curved);
}

// ---- the end of a job ---------------------------------------------------------------------------

// Passes the pieces that ask for no further step. True when that leads to the end of the path.
bool Inspector::pass_rest() {
    const Step nobody{kNoAxis, 0, 0, kAstraySteps};
    Cursor cursor{0, so_far_.share, so_far_.at, {}, pieces_.front().curved};
    for (; cursor.piece < kLookAhead; ++cursor.piece, cursor.share = 0) {
        const Piece& here = piece(cursor.piece);
        cursor.curved = cursor.curved || here.curved;
        if (here.kind == AskedItem::Kind::end) break;
        // A homing that never began.
        const bool waits = here.kind == AskedItem::Kind::home || here.kind == AskedItem::Kind::probe;
        if (waits && cursor.piece > 0) return false;
        if (here.kind != AskedItem::Kind::move) continue;
        if (shaped() ? beside(here.to) > kPassBalls : !pass_end(cursor, nobody)) return false;
        cursor.at = here.to;
    }
    if (cursor.piece >= kLookAhead) return false;
    cursor.share = 1;
    commit(cursor);
    return true;
}

Findings Inspector::finish(Instant now, bool read_rest) {
    if (homing_.active()) end_homing(homing_.settle(now, 0));
    if (probing_.active && has_probed(now)) end_probing();
    if (!remembered_.empty() && !is_clean_since(remembered_.back())) rest();
    take_leave();
    if (!counted_) ++so_far_.findings.excursions;
    so_far_.findings.away = away_;
    so_far_.findings.left_line = remembered_.empty() ? 0 : remembered_.back().pieces.front().line;
    so_far_.findings.line = pieces_.front().line;
    so_far_.findings.path_consumed = !homing_.active() && !probing_.active && pass_rest();
    while (read_rest && asked_.next().kind != AskedItem::Kind::end) {
    }
    final_asked_ = asked_.position();
    const Position built = built_mm();
    const Position reach = gantry_.reach_of(reach_mm_.mm);
    const Point asked_steps = so_far_.findings.path_consumed
                                  ? pieces_.back().to
                                  : to_steps(corrected(final_asked_, asked_.bed().now()));
    for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
        const double steps_per_mm = machine_.axes[axis].steps_per_mm;
        const double built_steps = static_cast<double>(position_[axis]) - origin_[axis];
        AxisFindings& found = so_far_.findings.axes[axis];
        found.reach_mm = reach[axis];
        found.turn_mm = turn_mm_[axis];
        found.path_deviation_mm_max = so_far_.worst[axis] / steps_per_mm;
        found.curve_deviation_mm_max = so_far_.worst_curved[axis] / steps_per_mm;
        found.final_asked_mm = final_asked_[axis];
        found.final_built_mm = built[axis];
        // Two belts that were homed along one axis may both be half a step off.
        const bool belt = gantry_.slides_of(axis) == 0b011;
        found.final_exact = std::abs(built_steps - asked_steps[axis]) <= (belt ? 1.0 : 0.5) + kTieSteps;
    }
    const double filament_steps_per_mm = machine_.axes[kExtruder].steps_per_mm;
    Findings& all = so_far_.findings;
    all.advance_gain = advance_.gain();
    all.advance_stretches = advance_.stretches();
    all.filament_asked_mm = asked_.filament_net_mm();
    all.filament_asked_pushed_mm = asked_.filament_pushed_mm();
    all.filament_built_mm = static_cast<double>(so_far_.net_steps) / filament_steps_per_mm;
    all.filament_built_pushed_mm = static_cast<double>(so_far_.pushed_steps) / filament_steps_per_mm;
    return all;
}

InspectionStart Inspector::next_start() const {
    InspectionStart start;
    start.built = position_;
    start.origin = origin_;
    start.pressed = pressed_;
    start.bed = asked_.bed().behind(machine_);
    start.maps = maps_;
    const Position built = built_mm();
    const auto exact = [&](std::size_t motor) { return so_far_.findings.axes[motor].final_exact; };
    for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
        // A job that was cut short leaves the firmware on whole steps: the fraction that was asked
        // last is gone.
        bool as_asked = so_far_.findings.path_consumed && exact(axis);
        for (std::size_t motor = 0; motor < kSlideCount && axis < kSlideCount; ++motor)
            as_asked = as_asked && (gantry_.slides_of(motor) == 1u << motor || exact(motor));
        start.asked_mm[axis] = as_asked ? final_asked_[axis] : built[axis];
    }
    return start;
}

}  // namespace qduino::twin
