#include "printer/machine/job_actions.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "printer/machine/vectors.h"

namespace qduino::printer::machine {

using gcode::AxisSet;
using gcode::Heater;
using link::ReplyKind;

// ---- motion -------------------------------------------------------------------------------------

/// A move by hand, by a button or by a typed line, needs to know where the axis is. A line of a job
/// or of a serial host is warned about instead (Interpreter).
Result<void> JobActions::check_homed_by_hand(const gcode::Move& move) const {
    const bool away = parts_.pipe.away();
    if (!away && speaker_ != Speaker::person) return {};
    for (const Axis axis : gcode::kToolAxes) {
        if (move.from[axis] == move.to[axis] || parts_.homing.homed(axis)) continue;
        return make_error(ErrorCode::unavailable, "home first: nobody knows where ", kAxisLetter[axis],
                          " is before it has been homed",
                          away ? " (it cannot be, while a job is paused)" : "");
    }
    return {};
}

Result<void> JobActions::move(const gcode::Move& move) {
    QDUINO_TRY(check_homed_by_hand(move));
    const double filament_mm = (move.to[Axis::e] - move.from[Axis::e]).value();
    QDUINO_TRY(parts_.heating.check_cold(filament_mm));
    motion::Correction& correction = parts_.pipe.correction();
    const bool away = parts_.pipe.away();
    if (!away) finish_rest();  // of a line with more moves than one
    if (correction.take_stale())
        append(correction.corrected(to_vector(move.from)), 0, parts_.config.axes[Axis::z].max_speed.value(),
               parts_.pipe.accelerations().travel);
    Rest whole{move, {}, 0, filament_mm, move.speed_factor, move.flow_factor};
    if (away) {
        finish(whole);
        return {};
    }
    const bool from_job = speaker_ == Speaker::job && parts_.link.job_running();
    if (from_job) {
        gcode::LayerFinder& layers = parts_.places.layers();
        if (move.kind == gcode::MoveKind::print && filament_mm > 0)
            layers.on_extrusion(move.to[Axis::z].value());
        whole.done.progress = {move.source.end_offset, move.source.line, layers.layers()};
        printed_.include(move);
    }
    rest_ = whole;
    if (parts_.pipe.planner().nominal_s(as_move(whole)) <= kWhole_s) finish_rest();
    return {};
}

motion::AxisVector JobActions::Rest::place_at(double share_of_way) const {
    const motion::AxisVector from = to_vector(move.from), to = to_vector(move.to);
    if (share_of_way == 0) return from;
    motion::AxisVector place{};
    for (std::size_t i = 0; i < kAxisCount; ++i) place[i] = from[i] + share_of_way * (to[i] - from[i]);
    return place;
}

/// All that is left of it, at the factors in force.
motion::Move JobActions::as_move(const Rest& rest) const {
    const gcode::Move& move = rest.move;
    const MillimetresPerSecond speed =
        rest.speed_factor == move.speed_factor
            ? move.feedrate
            : std::min(move.feedrate_asked * rest.speed_factor, move.feedrate_most);
    const motion::AxisVector to = to_vector(move.to);
    return {
        {to[0], to[1], to[2]}, rest.filament_mm, speed.value(), parts_.pipe.accelerations().of(move.kind)};
}

void JobActions::finish(const Rest& rest) {
    hand_on(rest.place_at(rest.share), to_vector(rest.move.to), as_move(rest));
    mark(rest.done);
}

void JobActions::finish_rest() {
    if (rest_) finish(*rest_);
    rest_.reset();
}

void JobActions::go_on() {
    QDUINO_EXPECT(has_rest() && !parts_.pipe.away());
    Rest& rest = *rest_;
    motion::Move piece = as_move(rest);
    const double pieces = std::ceil(parts_.pipe.planner().nominal_s(piece) / kPiece_s);
    if (pieces <= 1) return finish_rest();
    const motion::AxisVector from = rest.place_at(rest.share);
    rest.share += (1 - rest.share) / pieces;
    piece.filament_mm = rest.filament_mm / pieces;
    rest.filament_mm -= piece.filament_mm;
    hand_on(from, rest.place_at(rest.share), piece);
}

/// At the speed and with the filament of `how`. Over the bed that was measured a way is not
/// straight.
void JobActions::hand_on(const motion::AxisVector& from, const motion::AxisVector& to,
                         const motion::Move& how) {
    const motion::Correction& correction = parts_.pipe.correction();
    if (!correction.active()) return append(to, how.filament_mm, how.speed_mm_s, how.acceleration_mm_s2);
    double pushed_mm = 0;
    for (const motion::Correction::Piece& piece : correction.split(from, to)) {
        append(piece.end, piece.share * how.filament_mm - pushed_mm, how.speed_mm_s, how.acceleration_mm_s2);
        pushed_mm = piece.share * how.filament_mm;
    }
}

/// A straight way of the machine.
void JobActions::append(const motion::AxisVector& to, double filament_mm, double speed_mm_s,
                        double acceleration_mm_s2) {
    motion::Planner& planner = parts_.pipe.planner();
    motion::AxisVector end = to;
    end[Axis::e] = planner.position_mm()[Axis::e] + filament_mm;
    parts_.motors.on_for(planner.position_mm(), end);
    const bool fits = planner.append({{to[0], to[1], to[2]}, filament_mm, speed_mm_s, acceleration_mm_s2});
    QDUINO_EXPECT(fits);  // nothing is read without room for a line's pieces
}

Result<void> JobActions::dwell(Seconds duration) {
    finish_rest();
    // Loop 2 begins a new time line at the first event that it finds. Where nothing moves before
    // the dwell, that would be the dwell's end.
    mark({});
    const bool fits = parts_.pipe.planner().append_dwell(duration.value());
    QDUINO_EXPECT(fits);
    return {};
}

Result<void> JobActions::home(AxisSet axes) {
    finish_rest();
    parts_.homing.begin(axes);
    return {};
}

Result<void> JobActions::probe_bed() {
    finish_rest();
    parts_.homing.probe();
    return {};
}

Result<void> JobActions::change_bed(const gcode::BedChange& change) {
    motion::Correction& correction = parts_.pipe.correction();
    if (change.profile != gcode::BedProfile::none)
        QDUINO_TRY(parts_.profiles.apply(change.profile, change.name, correction));
    if (change.forget) correction.set_mesh({});
    if (change.fade_end) correction.set_fade_end(change.fade_end->value());
    if (change.skew) correction.set_skew(*change.skew);
    if (!change.follow) return {};
    if (*change.follow && !correction.mesh().known())
        parts_.link.say(ReplyKind::warning, "the bed has not been measured (G29): it is taken to be flat");
    correction.use_mesh(*change.follow);
    return {};
}

Result<void> JobActions::set_limits(const gcode::LimitChange& change) {
    parts_.pipe.change_limits(change);
    if (change.minimum_extrude) parts_.heating.set_minimum_extrude(*change.minimum_extrude);
    return {};
}

Result<void> JobActions::set_compensation(const gcode::CompensationChange& change) {
    parts_.pipe.change_compensation(change);
    return {};
}

// ---- at a place in the motion -------------------------------------------------------------------

void JobActions::place(const PlaceAction& action) {
    if (acts_at_once()) return perform(action);
    finish_rest();
    mark({action});
}

void JobActions::mark(const Place& place) {
    if (parts_.pipe.away()) return;  // what stands behind the stop keeps its numbers
    const bool fits = parts_.pipe.planner().append_marker(parts_.places.append(place));
    QDUINO_EXPECT(fits);
}

void JobActions::pass(const Place& place) {
    if (place.progress.end_offset != 0 && parts_.link.job_running()) {
        link::JobStatus& status = parts_.link.status();
        status.bytes_executed = place.progress.end_offset;
        status.line = place.progress.line;
        if (place.progress.layer != 0) status.layer = place.progress.layer;
    }
    perform(place.action);
}

void JobActions::perform(const PlaceAction& action) {
    if (const auto* heat = std::get_if<HeaterTarget>(&action)) {
        parts_.heating.set_target(heat->heater, heat->target);
    } else if (const auto* fan = std::get_if<FanDuty>(&action)) {
        parts_.heating.set_fan(fan->duty);
    } else if (const auto* off = std::get_if<MotorsOff>(&action)) {
        parts_.motors.off(off->axes);
        parts_.homing.forget(off->axes);
    }
}

Result<void> JobActions::set_temperature(Heater heater, Celsius target) {
    if (heater == Heater::bed && !parts_.config.has_bed && target.value() > 0) {
        return make_error(ErrorCode::unsupported, "this machine has no heated bed (machine file: has_bed)");
    }
    if (acts_at_once() && parts_.link.job_running() && parts_.heating.takes_heat(heater, target)) {
        parts_.heating.keep_targets();  // before they change: the job goes on with them
        request_ = HeatTaken{heater, target};
    }
    place(HeaterTarget{heater, target});
    return {};
}

Result<void> JobActions::wait_temperature(Heater heater, Celsius target, gcode::WaitFor direction) {
    QDUINO_TRY(set_temperature(heater, target));
    parts_.heating.wait().begin(heater, target, direction);
    return {};
}

Result<void> JobActions::set_heater(Heater heater, const gcode::HeaterChange& change) {
    parts_.heating.change(heater, change);
    return {};
}

Result<void> JobActions::tune_heater(const gcode::TuningAsked& asked) {
    parts_.heating.tune(asked);
    return {};
}

Result<void> JobActions::settings(gcode::SettingsAsked asked) {
    if (asked == gcode::SettingsAsked::factory) {
        parts_.heating.take_factory_settings();
        return {};
    }
    if (asked == gcode::SettingsAsked::restore) {
        parts_.heating.restore_settings();
        parts_.profiles.restore();
        return {};
    }
    const Result<void> named = parts_.profiles.keep(parts_.pipe.correction().mesh());
    parts_.link.keep(parts_.heating.keep_settings(), parts_.profiles.kept());
    return named;
}

Result<void> JobActions::set_fan(std::uint8_t index, double duty) {
    if (index == 0) place(FanDuty{duty});  // there is one fan; slicers may speak of others
    return {};
}

Result<void> JobActions::motors_off(AxisSet axes) {
    place(MotorsOff{axes});
    return {};
}

// ---- words and numbers --------------------------------------------------------------------------

void JobActions::factors(double speed, double flow) {
    parts_.link.status().feed_factor = speed;
    parts_.link.status().flow_factor = flow;
    if (!rest_) return;
    // What is drawn back or pushed by itself is to be undone as it is.
    if (rest_->move.kind == gcode::MoveKind::print) rest_->filament_mm *= flow / rest_->flow_factor;
    rest_->speed_factor = speed;
    rest_->flow_factor = flow;
}

void JobActions::note(gcode::NoteKind kind, std::string_view text, const gcode::Source& source) {
    if (kind == gcode::NoteKind::echo) return parts_.link.say(ReplyKind::text, text);
    if (speaker_ == Speaker::job && parts_.link.job_running() && has_been_said(text)) return;
    FixedString<400> line;
    if (source.line > 0 && speaker_ == Speaker::job) write(line, "line ", source.line, ": ");
    parts_.link.say(ReplyKind::warning, line.append(text));
}

/// A job's line would say what an earlier one of it has said: of a code that stands in every layer
/// once is enough.
bool JobActions::has_been_said(std::string_view text) {
    const std::uint64_t job = parts_.link.status().job_id;
    if (job != said_by_job_) said_.clear();
    said_by_job_ = job;
    const std::size_t sum = std::hash<std::string_view>{}(text);
    if (std::ranges::find(said_, sum) != said_.end()) return true;
    if (!said_.full()) said_.push_back(sum);
    return false;
}

// ---- what only the machine can do ---------------------------------------------------------------

Result<void> JobActions::pause(const gcode::PauseOrder& order) {
    const bool of_host = speaker_ == Speaker::host && !parts_.link.job_running();
    const bool of_job = speaker_ == Speaker::job && parts_.link.job_running();
    if (!of_host && !of_job) return {};
    if (!order.text.empty()) message(order.text);
    request_ = PauseAsked{order};
    std::get<PauseAsked>(*request_).order.text = {};
    return {};
}

}  // namespace qduino::printer::machine
