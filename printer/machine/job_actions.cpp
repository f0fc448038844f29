#include "printer/machine/job_actions.h"

#include "printer/machine/vectors.h"

namespace qduino::printer::machine {

using gcode::AxisSet;
using gcode::Heater;
using link::ReplyKind;

// ---- motion -------------------------------------------------------------------------------------

/// A jog beside the path needs to know where the axis is; a line of a job is warned about instead
/// (Interpreter).
Result<void> JobActions::check_homed_for_jog(const gcode::Move& move) const {
    if (!parts_.pipe.away()) return {};
    for (const Axis axis : gcode::kToolAxes) {
        if (move.from[axis] == move.to[axis] || parts_.homing.homed(axis)) continue;
        return make_error(ErrorCode::unavailable, kAxisLetter[axis],
                          " has not been homed: home first (it cannot be, while a job is paused)");
    }
    return {};
}

Result<void> JobActions::move(const gcode::Move& move) {
    QDUINO_TRY(check_homed_for_jog(move));
    const motion::AxisVector from = to_vector(move.from);
    const motion::AxisVector to = to_vector(move.to);
    const double filament_mm = to[3] - from[3];
    QDUINO_TRY(parts_.heating.check_cold(filament_mm));
    parts_.motors.on_for(from, to);
    const bool from_job = !typed_ && parts_.link.job_running();
    Place done;
    if (from_job) done.progress = {move.source.end_offset, move.source.line, parts_.places.layer()};
    const bool fits = parts_.pipe.planner().append({{to[0], to[1], to[2]},
                                                    filament_mm,
                                                    move.feedrate.value(),
                                                    parts_.pipe.accelerations().of(move.kind)});
    QDUINO_EXPECT(fits);  // nothing is read without room for a line's pieces
    mark(done);
    return {};
}

Result<void> JobActions::dwell(Seconds duration) {
    const bool fits = parts_.pipe.planner().append_dwell(duration.value());
    QDUINO_EXPECT(fits);
    return {};
}

Result<void> JobActions::home(AxisSet axes) {
    parts_.homing.begin(axes);
    return {};
}

Result<void> JobActions::set_limits(const gcode::LimitChange& change) {
    parts_.pipe.change_limits(change);
    return {};
}

// ---- at a place in the motion -------------------------------------------------------------------

void JobActions::place(const PlaceAction& action) {
    if (typed_) return perform(action);
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
    place(HeaterTarget{heater, target});
    return {};
}

Result<void> JobActions::wait_temperature(Heater heater, Celsius target, gcode::WaitFor direction) {
    QDUINO_TRY(set_temperature(heater, target));
    parts_.heating.wait().begin(heater, target, direction);
    return {};
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
}

void JobActions::progress(const gcode::Progress& progress) {
    if (progress.percent) parts_.link.status().progress_slicer = *progress.percent;
}

void JobActions::note(gcode::NoteKind kind, std::string_view text, const gcode::Source& source) {
    if (kind == gcode::NoteKind::echo) return parts_.link.say(ReplyKind::text, text);
    FixedString<400> line;
    if (source.line > 0 && !typed_) write(line, "line ", source.line, ": ");
    parts_.link.say(ReplyKind::warning, line.append(text));
}

// ---- what only the machine can do ---------------------------------------------------------------

Result<void> JobActions::pause(gcode::PauseReason, std::string_view text) {
    if (!parts_.link.job_running() || typed_) return {};
    if (!text.empty()) message(text);
    request_ = PauseAsked{};
    return {};
}

}  // namespace qduino::printer::machine
