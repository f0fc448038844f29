// What the interpreter asks of the machine, one small answer each.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "base/version.h"
#include "printer/gcode/reports.h"
#include "printer/machine/machine.h"

namespace qduino::printer::machine {

using gcode::AxisSet;
using gcode::Heater;
using link::ReplyKind;

namespace {

motion::AxisVector to_vector(const gcode::Position& position) {
    motion::AxisVector out{};
    for (Axis axis : gcode::kAllAxes) out[static_cast<std::size_t>(axis)] = position[axis].value();
    return out;
}

double bit_mask(AxisSet axes) {
    unsigned mask = 0;
    for (Axis axis : gcode::kAllAxes) mask |= axes.contains(axis) ? 1u << static_cast<unsigned>(axis) : 0u;
    return mask;
}

}  // namespace

Result<void> Machine::check_cold(double filament_mm) const {
    if (filament_mm == 0 || heat_seen_.hot_end.celsius >= config_.minimum_extrude.value()) return {};
    char text[160];
    std::snprintf(text, sizeof text,
                  "the hot end is at %.0f °C: filament moves only from %.0f °C on; heat it first (M109)",
                  heat_seen_.hot_end.celsius, config_.minimum_extrude.value());
    return make_error(ErrorCode::out_of_range, text);
}

void Machine::switch_motors(const motion::AxisVector& from, const motion::AxisVector& to) {
    for (std::size_t i = 0; i < kAxisCount; ++i) {
        if (from[i] == to[i] || motor_on_[i]) continue;
        motors_.switch_motor(static_cast<Axis>(i), motor_on_[i] = true);
    }
}

Result<void> Machine::move(const gcode::Move& move) {
    if (Result<void> homed = check_homed_for_jog(move); !homed.ok()) return homed;
    const motion::AxisVector from = to_vector(move.from);
    const motion::AxisVector to = to_vector(move.to);
    const double filament_mm = to[3] - from[3];
    if (Result<void> warm = check_cold(filament_mm); !warm.ok()) return warm;
    switch_motors(from, to);
    motion::Move planned;
    for (std::size_t i = 0; i < 3; ++i) planned.end_mm[i] = to[i];
    planned.filament_mm = filament_mm;
    planned.speed_mm_s = move.feedrate.value();
    planned.acceleration_mm_s2 = move.kind == gcode::MoveKind::print      ? acceleration_print_
                                 : move.kind == gcode::MoveKind::filament ? acceleration_filament_
                                                                          : acceleration_travel_;
    QDUINO_EXPECT(pipe_.planner().append(planned));  // may_read() keeps room for a line's pieces
    const bool from_job = !from_console_ && job_running();
    PlaceAction done;
    done.end_offset = from_job ? move.source.end_offset : 0;
    done.line = from_job ? move.source.line : 0;
    done.layer = from_job ? layers_.layers() : 0;
    place(done);
    return {};
}

void Machine::place(PlaceAction action) {
    if (from_console_ && action.kind != PlaceAction::Kind::nothing) return perform(action);
    if (away_ != Away::no) return;  // what stands behind the stop keeps its numbers
    QDUINO_EXPECT(pipe_.planner().append_marker(places_.next_number()));
    places_.append(action);
}

void Machine::perform(const PlaceAction& action) {
    if (action.end_offset != 0 && job_running()) {
        status_.bytes_executed = action.end_offset;
        status_.line = action.line;
        if (action.layer != 0) status_.layer = action.layer;
    }
    using Kind = PlaceAction::Kind;
    switch (action.kind) {
        case Kind::nothing:
            return;
        case Kind::hot_end_target:
            targets_.hot_end = Celsius{action.value};
            note_request(gcode::Heater::hot_end, targets_.hot_end);
            break;
        case Kind::bed_target:
            targets_.bed = Celsius{action.value};
            note_request(gcode::Heater::bed, targets_.bed);
            break;
        case Kind::fan:
            targets_.fan_duty = action.value;
            break;
        case Kind::motors_off:
            for (std::size_t i = 0; i < kAxisCount; ++i) {
                if (((static_cast<unsigned>(action.value) >> i) & 1u) == 0) continue;
                motors_.switch_motor(static_cast<Axis>(i), motor_on_[i] = false);
                if (i < homed_.size()) homed_[i] = false;
            }
            return;
    }
    heat_.set_targets(targets_);
}

Result<void> Machine::dwell(Seconds duration) {
    QDUINO_EXPECT(pipe_.planner().append_dwell(duration.value()));
    return {};
}

Result<void> Machine::home(AxisSet axes) {
    homing_.begin(axes);
    wait_ = Wait::homing;
    return {};
}

Result<void> Machine::set_temperature(Heater heater, Celsius target) {
    if (heater == Heater::bed && !config_.has_bed && target.value() > 0) {
        return make_error(ErrorCode::unsupported, "this machine has no heated bed (machine file: has_bed)");
    }
    PlaceAction action;
    action.kind =
        heater == Heater::hot_end ? PlaceAction::Kind::hot_end_target : PlaceAction::Kind::bed_target;
    action.value = target.value();
    place(action);
    return {};
}

Result<void> Machine::wait_temperature(Heater heater, Celsius target, gcode::WaitFor direction) {
    Result<void> set = set_temperature(heater, target);
    if (!set.ok()) return set;
    wait_ = Wait::temperature;
    wait_heater_ = heater;
    wait_target_ = target.value();
    wait_direction_ = direction;
    at_target_since_.reset();
    return {};
}

Result<void> Machine::set_fan(std::uint8_t index, double duty) {
    if (index != 0) return {};  // there is one fan; slicers may speak of others
    PlaceAction action;
    action.kind = PlaceAction::Kind::fan;
    action.value = duty;
    place(action);
    return {};
}

Result<void> Machine::motors_off(AxisSet axes) {
    PlaceAction action;
    action.kind = PlaceAction::Kind::motors_off;
    action.value = bit_mask(axes);
    place(action);
    return {};
}

Result<void> Machine::set_limits(const gcode::LimitChange& change) {
    motion::MotionSettings settings = pipe_.planner().settings();
    for (std::size_t i = 0; i < kAxisCount; ++i) {
        if (change.axis_acceleration[i]) settings.max_acceleration[i] = *change.axis_acceleration[i];
        if (change.axis_speed[i]) settings.max_speed[i] = *change.axis_speed[i];
        if (change.axis_instantaneous_speed[i]) {
            settings.instantaneous_speed[i] = *change.axis_instantaneous_speed[i];
        }
    }
    settings.square_corner_speed =
        std::min(settings.instantaneous_speed[Axis::x], settings.instantaneous_speed[Axis::y]);
    if (change.print_acceleration) acceleration_print_ = change.print_acceleration->value();
    if (change.travel_acceleration) acceleration_travel_ = change.travel_acceleration->value();
    if (change.filament_acceleration) acceleration_filament_ = change.filament_acceleration->value();
    if (change.junction_deviation) {
        // δ back to the speed of a square corner (junction.h), at the acceleration now in force.
        settings.square_corner_speed = MillimetresPerSecond{
            std::sqrt(change.junction_deviation->value() * acceleration_print_ / (std::sqrt(2.0) - 1))};
    }
    pipe_.planner().set_settings(settings);
    return {};
}

void Machine::factors(double speed, double flow) {
    status_.feed_factor = speed;
    status_.flow_factor = flow;
}

void Machine::message(std::string_view text) { status_.message.assign(text); }

void Machine::progress(const gcode::Progress& progress) {
    if (progress.percent) status_.progress_slicer = *progress.percent;
}

void Machine::report(gcode::Report what) {
    gcode::ReportText text;
    if (what == gcode::Report::temperatures) {
        const auto reading = [](const link::HeaterStatus& h) {
            return gcode::HeaterReading{Celsius{h.celsius}, Celsius{h.target_celsius}, h.duty};
        };
        text = gcode::format_temperatures(
            {reading(heat_seen_.hot_end), reading(heat_seen_.bed), config_.has_bed});
    } else if (what == gcode::Report::position) {
        gcode::PositionReport position{shown_interpreter().programmed_position(), {pipe_.seen().steps}};
        for (std::size_t i = 0; i < kAxisCount; ++i) position.steps[i] -= origin_[i];
        text = gcode::format_position(position);
    } else {
        text = gcode::format_firmware({version(), config_.name, "", false, true});
    }
    reply(ReplyKind::text, text);
}

Result<void> Machine::pause(gcode::PauseReason, std::string_view text) {
    if (!job_running() || from_console_) return {};
    if (!text.empty()) status_.message.assign(text);
    status_.state = link::MachineState::pausing;
    pause_at_end_ = true;
    return {};
}

void Machine::emergency_stop() { enter_fault("emergency stop (M112)"); }

void Machine::note(gcode::NoteKind kind, std::string_view text, const gcode::Source& source) {
    if (kind == gcode::NoteKind::echo) return reply(ReplyKind::text, text);
    FixedString<400> line;
    if (source.line > 0 && !from_console_) {
        char place[32];
        std::snprintf(place, sizeof place, "line %llu: ", static_cast<unsigned long long>(source.line));
        line.append(place);
    }
    line.append(text);
    reply(ReplyKind::warning, line);
}

}  // namespace qduino::printer::machine
