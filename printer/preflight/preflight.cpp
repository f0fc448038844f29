#include "printer/preflight/preflight.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "printer/gcode/text.h"

namespace qduino::printer::preflight {
namespace {

constexpr std::string_view kSliceAgain = "Slice the model again with this printer's profile.";

std::string_view advice_for(ErrorCode code, std::string_view message) {
    if (code == ErrorCode::corrupt) return "The file was damaged on its way: send it again.";
    if (code == ErrorCode::unsupported)
        return "Slice for this printer, which has one tool and the G-codes of its page in docs/gcode.md.";
    if (code == ErrorCode::not_found)
        return "Write what it stands for into [macros] of the machine file, or slice for this printer.";
    if (message.find("more than one command") != std::string_view::npos)
        return "A printer reads one command a line. A file of a CAM program is for another machine: slice "
               "the model.";
    if (message.find("takes no ") != std::string_view::npos)
        return "The file is for a machine with another axis, or for another firmware: slice for this "
               "printer.";
    if (message.find("NUL byte") != std::string_view::npos)
        return "Export the file again, and send it whole.";
    if (code != ErrorCode::out_of_range) return "Look at this line: the file may be damaged, or no G-code.";
    if (message.find("°C") != std::string_view::npos)
        return "Lower this temperature in the filament's settings.";
    if (message.find("would go to") != std::string_view::npos) {
        return "Move or scale the model on the bed, and slice it with this printer's profile.";
    }
    return kSliceAgain;
}

}  // namespace

void Bounds::include(const gcode::Position& position) {
    for (std::size_t i = 0; i < minimum.size(); ++i) {
        minimum[i] = empty ? position[i] : std::min(minimum[i], position[i]);
        maximum[i] = empty ? position[i] : std::max(maximum[i], position[i]);
    }
    empty = false;
}

Preflight::Preflight(const MachineConfig& machine)
    : machine_(machine),
      kinematics_(machine),
      interpreter_(machine_, *this),
      minimum_extrude_(machine.minimum_extrude) {
    for (const Axis axis : gcode::kAllAxes) speed_max_[axis] = machine.axes[axis].max_speed;
}

void Preflight::add_sink(MoveSink& sink) {
    QDUINO_EXPECT(facts_.bytes == 0);
    sinks_.push_back(&sink);
}

void Preflight::feed(std::span<const char> bytes) {
    look(bytes);
    facts_.bytes += bytes.size();
    end_.on_bytes(bytes);
    if (!refused_) parser_.feed(bytes, [this](const gcode::Line& line) { on_line(line); });
}

const Facts& Preflight::finish() {
    if (!judged_) judge_content();
    if (!refused_) {
        parser_.finish([this](const gcode::Line& line) { on_line(line); });
        if (const auto done = interpreter_.finish(); !done)
            add_error(done.error().message, advice_for(done.error().code, done.error().message));
        check_whole();
    }
    facts_.thumbnail = thumbnail_.best();
    facts_.layers = layers_.layers();
    for (MoveSink* sink : sinks_) sink->on_end(facts_.bytes);
    return facts_;
}

void Preflight::look(std::span<const char> bytes) {
    if (judged_) return;
    const std::size_t count = std::min(bytes.size(), head_.size() - head_count_);
    std::memcpy(head_.data() + head_count_, bytes.data(), count);
    head_count_ += count;
    if (head_count_ == head_.size()) judge_content();
}

void Preflight::judge_content() {
    judged_ = true;
    facts_.content = gcode::look_at_content({head_.data(), head_count_}, machine_);
    refused_ = facts_.content != gcode::Content::gcode;
    if (!refused_) return;
    line_ = nullptr;
    // The file is no G-code: the errors that its bytes raised as G-code mean nothing.
    facts_.errors.clear();
    facts_.warnings.clear();
    facts_.errors_count = facts_.warnings_count = facts_.start_errors = 0;
    facts_.unmendable.reset();
    add_error(gcode::explain(facts_.content), "Send the .gcode file that the slicer exports.");
}

void Preflight::on_line(const gcode::Line& line) {
    line_ = &line;
    ++facts_.lines;
    if (interpreter_.program_ended() && (line.error || line.command != nullptr)) {
        if (!said_ended_)
            add_warning(
                "the program has ended before this line (M2, M30): it and what follows are not carried out",
                "Take the M2 or M30 out if they are to be.");
        said_ended_ = true;
    } else if (const auto heeded = heed(line); !heeded) {
        add_error(heeded.error().message,
                  "Or write dialect = \"klipper\" (or \"reprap\", \"marlin\") into the machine file.");
    } else if (line.error) {
        add_error(line.error->message, advice_for(line.error->code, line.error->message));
    } else if (line.command != nullptr) {
        ++facts_.commands;
        end_.on_command(line.command->letter == 'G' && line.command->number <= 5 &&
                        line.command->number != 4);
        if (auto done = interpreter_.execute(*line.command); !done) {
            add_error(done.error().message, advice_for(done.error().code, done.error().message));
        }
    } else if (!line.comment.empty()) {
        on_comment(line);
    }
    line_ = nullptr;
}

/// Behind the program's end only what people are shown is read.
Result<void> Preflight::heed(const gcode::Line& line) {
    return interpreter_.program_ended() ? Result<void>{} : interpreter_.heed(line);
}

void Preflight::on_comment(const gcode::Line& line) {
    if (thumbnail_.on_comment(line.comment)) return;
    end_.on_comment(line.comment);
    const gcode::Annotation annotation = gcode::parse_annotation(line.comment);
    if (annotation.kind == gcode::AnnotationKind::none) {
        take_comment(facts_.metadata, line.comment);
    } else {
        layers_.on_annotation(annotation, line.source);
    }
}

Result<void> Preflight::move(const gcode::Move& move) {
    ++facts_.moves;
    facts_.bounds.include(move.to);
    const MoveContext& context = layers_.on_move(move);
    if (context.extrudes) {
        facts_.extruding_bounds.include(move.from);
        facts_.extruding_bounds.include(move.to);
        measure_layers(context);
    }
    filament_end_ = std::max(filament_end_, move.to[Axis::e]);
    facts_.filament = filament_end_;
    check_homed(move);
    check_extrusion(move);
    check_step_rate(move);
    for (MoveSink* sink : sinks_) sink->on_move(move, context);
    return {};
}

void Preflight::measure_layers(const MoveContext& context) {
    const Layer& layer = context.layer;
    if (layer.index == 0) {
        first_layer_z_mm_ = layer.z_mm;
        facts_.first_layer_height = Millimetres{layer.height_mm > 0 ? layer.height_mm : layer.z_mm};
    } else if (layer.z_mm > top_layer_z_mm_) {
        facts_.layer_height = Millimetres{(layer.z_mm - first_layer_z_mm_) / layer.index};
    }
    top_layer_z_mm_ = std::max(top_layer_z_mm_, layer.z_mm);
}

Result<void> Preflight::home(gcode::AxisSet axes) {
    for (const Axis axis : gcode::kToolAxes) was_homed_[axis] = was_homed_[axis] || axes.contains(axis);
    for (MoveSink* sink : sinks_) sink->on_home(axes);
    return {};
}

Result<void> Preflight::probe_bed() {
    for (MoveSink* sink : sinks_) sink->on_probe();
    return {};
}

void Preflight::check_homed(const gcode::Move& move) {
    for (const Axis axis : gcode::kToolAxes) {
        if (was_homed_[axis] || move.from[axis] == move.to[axis]) continue;
        was_homed_[axis] = true;  // one word of it is enough
        if (let_go_[axis])
            add_error(text(kAxisLetter[axis],
                           " moves after its motors went off (M84, M18): nobody knows where it is"),
                      "Home it first (G28), or switch the motors off only at the end.");
        if (let_go_[axis]) continue;
        add_start_error(text(kAxisLetter[axis], " moves before anything has homed it"),
                        "Write G28 into the printer's start G-code in the slicer: the job brings no "
                        "homing of its own.");
    }
}

void Preflight::check_extrusion(const gcode::Move& move) {
    if (move.from[Axis::e] == move.to[Axis::e]) return;
    const double needed = minimum_extrude_.value();
    const bool was_hot = told_cold_ || may_extrude(machine_, minimum_extrude_, waited_for_);
    if (hot_end_target_ >= minimum_extrude_) {
        if (was_hot) return;
        told_cold_ = true;  // one word of it is enough
        add_start_error(text("filament is moved before anything has waited for the hot end to reach ",
                             Shortest{hot_end_target_.value()}, " °C"),
                        "Wait for it with M109 before this line: the job brings no heating of its own.");
    } else if (!was_hot) {
        const auto message =
            text("filament is moved while the hot end is set to ", Shortest{hot_end_target_.value()},
                 " °C; it takes ", Shortest{needed}, " °C");
        constexpr std::string_view kHeatFirst =
            "Heat first: M109 S200, or what the filament needs, before this line. The job brings no heating "
            "of its own.";
        hot_end_target_.value() <= 0 ? add_start_error(message, kHeatFirst) : add_error(message, kHeatFirst);
    } else if (move.to[Axis::e] > move.from[Axis::e]) {
        // The hot end cools slowly, so a last wipe after M104 S0 is common and works. More than
        // that may not.
        add_warning("filament is pushed after the hot end was set below extrusion temperature",
                    "Switch the hot end off after the last extrusion.");
    }
}

void Preflight::check_step_rate(const gcode::Move& move) {
    AxisValues from{}, to{}, way{};
    for (const Axis axis : gcode::kAllAxes) {
        from[axis] = move.from[axis].value();
        to[axis] = move.to[axis].value();
        way[axis] = std::abs(to[axis] - from[axis]);
    }
    const double tool_mm2 = way[0] * way[0] + way[1] * way[1] + way[2] * way[2];
    const double length_mm = tool_mm2 > 0 ? std::sqrt(tool_mm2) : way[Axis::e];
    const AxisValues rates = kinematics_.rates(from, to, length_mm);
    // As the planner does: the whole move is slowed until no axis, and no motor, is above its own
    // limit.
    double duration_s = length_mm / move.feedrate.value();
    for (const Axis axis : gcode::kAllAxes) {
        const double most_mm = std::max(way[axis], rates[axis] * length_mm);
        duration_s = std::max(duration_s, most_mm / speed_max_[axis].value());
    }
    double together_hz = 0;
    for (const Axis axis : gcode::kAllAxes) {
        const AxisConfig& motor = machine_.axes[axis];
        const double rate_hz = rates[axis] * length_mm * motor.steps_per_mm / duration_s;
        together_hz += rate_hz * static_cast<double>(1 + motor.extra_motors.size());
        check_motor_rate(axis, rate_hz);
    }
    const double limit_hz = step_rate_limit_hz(machine_.step_cost);
    if (limit_hz <= 0 || together_hz <= limit_hz) return;
    add_error(text("the motors together would need ", std::llround(together_hz),
                   " steps/s; this computer plays at most ", std::llround(limit_hz), " (one takes ",
                   machine_.step_cost, ", measured)"),
              "Lower the speed in the slicer, or take coarser microsteps.");
}

void Preflight::check_motor_rate(Axis motor, double rate_hz) {
    facts_.step_rate_maximum_hz = std::max(facts_.step_rate_maximum_hz, rate_hz);
    const double rate_max_hz = 1 / to_seconds(step_interval(machine_));
    if (rate_hz <= rate_max_hz * (1 + 1e-9)) return;
    add_error(text(kAxisLetter[motor], " would need ", std::llround(rate_hz),
                   " steps/s; this board plays at most ", std::llround(rate_max_hz)),
              "Lower the speed in the slicer, or the axis' largest speed with M203.");
}

Result<void> Preflight::dwell(Seconds duration) {
    const double timeout_s = machine_.idle_timeout.value();
    const bool heated = hot_end_target_.value() > 0 || bed_target_.value() > 0;
    if (heated && timeout_s > 0 && duration.value() > timeout_s) {
        add_warning(text("a dwell of ", Shortest{duration.value()}, " s is longer than the idle time-out of ",
                         Shortest{timeout_s}, " s: the heaters go off in it, and the job pauses"),
                    "Shorten it, or raise idle_timeout_s in the machine file.");
    }
    for (MoveSink* sink : sinks_) sink->on_dwell(duration);
    return {};
}

void Preflight::take_target(gcode::Heater heater, Celsius target) {
    const bool is_bed = heater == gcode::Heater::bed;
    Celsius& maximum = is_bed ? facts_.bed_maximum : facts_.hot_end_maximum;
    maximum = std::max(maximum, target);
    (is_bed ? bed_target_ : hot_end_target_) = target;
}

Result<void> Preflight::set_temperature(gcode::Heater heater, Celsius target) {
    take_target(heater, target);
    for (MoveSink* sink : sinks_) sink->on_temperature(heater, target, std::nullopt);
    return {};
}

Result<void> Preflight::wait_temperature(gcode::Heater heater, Celsius target, gcode::WaitFor direction) {
    const Celsius reached =
        direction.kind == gcode::WaitFor::between ? direction.lowest : content_from(machine_.hot_end, target);
    // A wait that cools leaves the hot end as cool as that; one that heats alone, no cooler than
    // it was.
    const bool cools = direction.kind != gcode::WaitFor::heating;
    if (heater == gcode::Heater::hot_end) waited_for_ = cools ? reached : std::max(waited_for_, reached);
    take_target(heater, target);
    for (MoveSink* sink : sinks_) sink->on_temperature(heater, target, direction);
    return {};
}

Result<void> Preflight::set_limits(const gcode::LimitChange& change) {
    for (const Axis axis : gcode::kAllAxes)
        speed_max_[axis] = change.axis_speed[axis].value_or(speed_max_[axis]);
    minimum_extrude_ = change.minimum_extrude.value_or(minimum_extrude_);
    for (MoveSink* sink : sinks_) sink->on_limits(change);
    return {};
}

Result<void> Preflight::pause(const gcode::PauseOrder&) {
    for (MoveSink* sink : sinks_) sink->on_pause();
    return {};
}

Result<void> Preflight::motors_off(gcode::AxisSet axes) {
    gcode::AxisSet unhomed;
    for (const Axis axis : gcode::kToolAxes) {
        if (!was_homed_[axis] || !kinematics_.shares_motor(axis, axes)) continue;
        was_homed_[axis] = false;
        let_go_[axis] = true;
        unhomed.add(axis);
    }
    for (MoveSink* sink : sinks_) sink->on_motors_off(unhomed);
    return {};
}

void Preflight::emergency_stop() {
    add_error("M112, the emergency stop, would end this job here",
              "Remove it from the slicer's custom G-code.");
}

void Preflight::progress(const gcode::Progress& progress) {
    if (progress.percent) end_.on_percent(*progress.percent);
}

void Preflight::note(gcode::NoteKind kind, std::string_view text, const gcode::Source&) {
    if (kind == gcode::NoteKind::echo) return;
    add_warning(text, kind == gcode::NoteKind::unknown_code ? "It will be skipped."
                      : kind == gcode::NoteKind::not_done   ? "The part is the same without it."
                                                            : "");
}

void Preflight::check_whole() {
    line_ = nullptr;
    facts_.unknown_codes = interpreter_.unknown_codes();
    facts_.codes_not_done = interpreter_.codes_not_done();
    if (facts_.commands == facts_.unknown_codes && facts_.errors_count == 0) {
        add_error("the file holds no command that this printer knows", kSliceAgain);
    }
    check_end();
}

void Preflight::check_end() {
    if (const std::string_view why = end_.why_cut(); !why.empty()) {
        add_warning(text("the file seems to be cut off: ", why), "Send it again, whole.");
    }
    const bool hot = hot_end_target_.value() > 0, bed = bed_target_.value() > 0;
    if (!hot && !bed) return;
    add_warning(
        text("the file ends with the ", hot ? "hot end" : "bed", hot && bed ? " and the bed" : "", " on"),
        "The printer switches off what is on, and lifts the head above the part.");
}

Finding Preflight::finding(std::string_view message, std::string_view advice) const {
    Finding found{0, 0, {}, message, advice};
    if (line_ != nullptr) {
        found.line = line_->source.line;
        found.offset = line_->source.offset;
        gcode::append_printable(found.text, line_->text);
    }
    return found;
}

/// The first of these is what a person is told: however many start errors stand before it, it is
/// kept.
void Preflight::add_error(std::string_view message, std::string_view advice) {
    ++facts_.errors_count;
    const bool first = !facts_.unmendable.has_value();
    if (first) facts_.unmendable = std::min(facts_.errors.size(), kFindingsMax - 1);
    if (!facts_.errors.full()) return facts_.errors.push_back(finding(message, advice));
    if (first) facts_.errors[*facts_.unmendable] = finding(message, advice);
}

/// An error that a prologue mends.
void Preflight::add_start_error(std::string_view message, std::string_view advice) {
    ++facts_.errors_count;
    ++facts_.start_errors;
    if (!facts_.errors.full()) facts_.errors.push_back(finding(message, advice));
}

void Preflight::add_warning(std::string_view message, std::string_view advice) {
    ++facts_.warnings_count;
    const auto same = [&](const Finding& held) { return held.message == message; };
    if (facts_.warnings.full() || std::ranges::any_of(facts_.warnings, same)) return;
    facts_.warnings.push_back(finding(message, advice));
}

}  // namespace qduino::printer::preflight
