// Klipper's words, and objects of a plate: what slicers write for machines that speak words.
//
// Facts: Klipper's documentation, "G-Codes" and "Exclude Objects"; Marlin 2.1, M486.
#include <algorithm>

#include "printer/gcode/context.h"
#include "printer/gcode/text.h"
#include "printer/gcode/word_parameters.h"

namespace qduino::printer::gcode::handlers {
namespace {

constexpr double kShiftMax_mm = 1000;
constexpr double kObjectIndexMax = 9999;
/// No sensor shows more.
constexpr double kHottestWait = 1000;

/// X, Y, Z or E of SET_GCODE_OFFSET: the new offset, given whole or as a change; none: not named.
Result<std::optional<Millimetres>> asked_offset(const Command& command, Axis axis, Millimetres now) {
    const FixedString<1> letter{std::string_view{&kAxisLetter[axis], 1}};
    const auto adjust = text<FixedString<16>>(kAxisLetter[axis], "_ADJUST");
    QDUINO_TRY_ASSIGN(const auto whole,
                      word_number_within(command, letter.view(), -kShiftMax_mm, kShiftMax_mm));
    QDUINO_TRY_ASSIGN(const auto change,
                      word_number_within(command, adjust.view(), -kShiftMax_mm, kShiftMax_mm));
    if (whole) return std::optional{Millimetres{*whole}};
    if (change) return std::optional{now + Millimetres{*change}};
    return std::optional<Millimetres>{};
}

/// `NAME=lid`, or Klipper's bare `lid`; empty: none is named.
Result<std::string_view> object_name(const Command& command) {
    QDUINO_TRY_ASSIGN(const auto name,
                      word_name(command, "NAME", {"CURRENT", "RESET", "CENTER", "POLYGON", "JSON"}));
    if (name) return *name;
    const std::string_view given = trim(command.text.view());
    return given.find('=') == std::string_view::npos ? given : std::string_view{};
}

/// Error: `had_room` is false.
Result<void> left_out(bool had_room) {
    if (had_room) return {};
    return make_error(ErrorCode::out_of_range, "more than ", Objects::kExcludedMax,
                      " objects cannot be left out");
}

/// M486 counts objects: the name of number 2 is "2".
FixedString<24> numbered(double index) { return text<FixedString<24>>(static_cast<std::int64_t>(index)); }

Result<std::optional<double>> object_index(const Command& command, char letter) {
    return number_within(command, letter, -kObjectIndexMax, kObjectIndexMax, "");
}

/// The heater that Klipper calls `name`.
Result<Heater> heater_called(std::string_view name) {
    if (name == "extruder") return Heater::hot_end;
    if (name == "heater_bed") return Heater::bed;
    return make_error(ErrorCode::unsupported, "this machine has no heater ", name);
}

/// SAVE_GCODE_STATE and RESTORE_GCODE_STATE name it so.
Result<std::string_view> state_name(const Command& command) {
    QDUINO_TRY_ASSIGN(const auto name, word_name(command, "NAME", {"MOVE", "MOVE_SPEED"}));
    return name.value_or("default");
}

Result<SavedState*> find_saved(Context& context, std::string_view name) {
    const auto found = std::ranges::find(context.saved, key_of(name), &SavedState::name);
    if (found != context.saved.end()) return &*found;
    return make_error(ErrorCode::not_found, "no state was saved as ", name);
}

/// The object that is being printed.
Result<void> leave_out_current(Context& context) {
    if (context.objects.inside()) return left_out(context.objects.exclude_current());
    return make_error(ErrorCode::unavailable, "no object is being printed");
}

}  // namespace

/// SET_HEATER_TEMPERATURE HEATER=extruder TARGET=200.
Result<void> heater_temperature(Context& context, const Command& command) {
    QDUINO_TRY_ASSIGN(const Heater heater, heater_called(word_value(command.text, "HEATER").value_or("")));
    const HeaterConfig& config = heater == Heater::bed ? context.config.bed : context.config.hot_end;
    QDUINO_TRY_ASSIGN(const auto target,
                      word_number_within(command, "TARGET", 0, highest_target(config).value()));
    return set_target(context, heater, Celsius{target.value_or(0)});
}

/// TEMPERATURE_WAIT SENSOR=heater_bed MINIMUM=55 MAXIMUM=65: the targets stay. Klipper waits for
/// ever where a target does not lead there; that is an error here.
Result<void> temperature_wait(Context& context, const Command& command) {
    QDUINO_TRY_ASSIGN(const Heater heater, heater_called(word_value(command.text, "SENSOR").value_or("")));
    const bool is_bed = heater == Heater::bed;
    const Celsius most = highest_target(is_bed ? context.config.bed : context.config.hot_end);
    QDUINO_TRY_ASSIGN(const auto lowest, word_number_within(command, "MINIMUM", 0, most.value()));
    QDUINO_TRY_ASSIGN(const auto highest, word_number_within(command, "MAXIMUM", 0, kHottestWait));
    if (!lowest && !highest)
        return make_error(ErrorCode::invalid_argument, "needs MINIMUM or MAXIMUM, a temperature");
    const Celsius target = is_bed ? context.state.bed_target : context.state.hot_end_target;
    const double from = lowest.value_or(0), to = highest.value_or(kHottestWait);
    const bool gets_there =
        from <= to && from <= target.value() && to >= std::max(target.value(), context.config.room.value());
    if (!gets_there)
        return make_error(ErrorCode::unavailable, "it would wait for ever: the target is ",
                          Shortest{target.value()}, " °C");
    return set_target(context, heater, target, WaitFor{Celsius{from}, Celsius{to}});
}

Result<void> heaters_off(Context& context, const Command&) {
    QDUINO_TRY(set_target(context, Heater::hot_end, Celsius{0}));
    return set_target(context, Heater::bed, Celsius{0});
}

/// SET_VELOCITY_LIMIT VELOCITY= ACCEL= SQUARE_CORNER_VELOCITY=. The machine's own limits stay.
Result<void> velocity_limit(Context& context, const Command& command) {
    QDUINO_TRY_ASSIGN(const auto speed,
                      word_number_within(command, "VELOCITY", kSlowest.value(), kFastest.value()));
    QDUINO_TRY_ASSIGN(const auto acceleration,
                      word_number_within(command, "ACCEL", kAccelerationMin_mm_s2, kAccelerationMax_mm_s2));
    QDUINO_TRY_ASSIGN(const auto corner, word_number_within(command, "SQUARE_CORNER_VELOCITY", 0, 1000));
    LimitChange change;
    if (acceleration) {
        change.print_acceleration = MillimetresPerSecond2{*acceleration};
        change.travel_acceleration = change.print_acceleration;
    }
    for (const Axis axis : {Axis::x, Axis::y}) {
        const MillimetresPerSecond configured = context.config.axes[axis].instantaneous_speed;
        if (corner) {
            change.axis_instantaneous_speed[axis] = std::min(MillimetresPerSecond{*corner}, configured);
        }
    }
    if (acceleration || corner) QDUINO_TRY(context.actions.set_limits(change));
    if (speed) context.state.speed_limit = MillimetresPerSecond{*speed};
    return {};
}

/// SET_GCODE_OFFSET X= Y= Z= E=, or X_ADJUST= …; MOVE=1 goes there at MOVE_SPEED (mm/s).
Result<void> code_offset(Context& context, const Command& command) {
    ModalState& state = context.state;
    Position changed = state.code_offset;
    for (const Axis axis : kAllAxes) {
        QDUINO_TRY_ASSIGN(const auto asked, asked_offset(command, axis, state.code_offset[axis]));
        if (asked) changed[axis] = *asked;
    }
    QDUINO_TRY_ASSIGN(const auto move, word_number(command, "MOVE"));
    QDUINO_TRY_ASSIGN(const auto speed,
                      word_number_within(command, "MOVE_SPEED", kSlowest.value(), kFastest.value()));
    Position target = state.machine;
    for (const Axis axis : kToolAxes) {
        const Millimetres change = changed[axis] - state.code_offset[axis];
        state.offset[axis] += change;
        if (move.value_or(0) != 0) target[axis] += change;
    }
    state.programmed_e -= changed[Axis::e] - state.code_offset[Axis::e];
    state.code_offset = changed;
    QDUINO_TRY(context.check_target(target));
    if (context.goes_sideways(target)) QDUINO_TRY(context.rejoin(target));
    return context.move_to(target, speed ? MillimetresPerSecond{*speed} : state.feedrate);
}

/// SAVE_GCODE_STATE NAME=pause.
Result<void> save_state(Context& context, const Command& command) {
    QDUINO_TRY_ASSIGN(const std::string_view name, state_name(command));
    const Result<SavedState*> held = find_saved(context, name);
    if (held) {
        (*held)->state = context.state;
        return {};
    }
    if (context.saved.try_push_back({key_of(name), context.state})) return {};
    return make_error(ErrorCode::out_of_range, "more than ", Context::kSavedMax, " states cannot be saved");
}

/// RESTORE_GCODE_STATE NAME=pause: modes, coordinates, speed and factors; E is called as it was.
/// MOVE=1 goes back to the place at MOVE_SPEED (mm/s).
Result<void> restore_state(Context& context, const Command& command) {
    QDUINO_TRY_ASSIGN(const std::string_view name, state_name(command));
    QDUINO_TRY_ASSIGN(const SavedState* const saved, find_saved(context, name));
    QDUINO_TRY_ASSIGN(const auto move, word_number(command, "MOVE"));
    QDUINO_TRY_ASSIGN(const auto speed,
                      word_number_within(command, "MOVE_SPEED", kSlowest.value(), kFastest.value()));
    ModalState& state = context.state;
    const ModalState& then = saved->state;
    state.relative = then.relative;
    // As they were said: the dialect may have become another meanwhile.
    state.said_relative_e = then.said_relative_e;
    state.axes_came_last = then.axes_came_last;
    state.relative_e = state.dialect == then.dialect ? then.relative_e : then.said_relative_e;
    state.feedrate = then.feedrate;
    state.speed_factor = then.speed_factor;
    state.flow_factor = then.flow_factor;
    state.home_offset = then.home_offset;
    state.code_offset = then.code_offset;
    state.offset = then.offset;
    state.offset[Axis::z] += state.lifted - then.lifted;  // by a G10 that is still in force
    state.programmed_e = then.programmed_e;
    context.actions.factors(state.speed_factor, state.flow_factor);
    if (move.value_or(0) == 0) return {};
    Position target = then.machine;
    target[Axis::e] = state.machine[Axis::e];
    QDUINO_TRY(context.check_target(target));
    if (context.goes_sideways(target)) QDUINO_TRY(context.rejoin(target));
    return context.move_to(target, speed ? MillimetresPerSecond{*speed} : state.feedrate);
}

/// ACTIVATE_EXTRUDER EXTRUDER=extruder.
Result<void> choose_extruder(Context&, const Command& command) {
    if (word_value(command.text, "EXTRUDER").value_or("extruder") == "extruder") return {};
    return make_error(ErrorCode::unsupported, "this machine has one tool, T0");
}

// ---- objects ------------------------------------------------------------------------------------

Result<void> object_begins(Context& context, const Command& command) {
    QDUINO_TRY_ASSIGN(const std::string_view name, object_name(command));
    context.objects.begin(name);
    return {};
}

Result<void> object_ends(Context& context, const Command&) {
    context.objects.end();
    return {};
}

/// EXCLUDE_OBJECT NAME=lid, CURRENT=1, or RESET=1.
Result<void> exclude_object(Context& context, const Command& command) {
    Objects& objects = context.objects;
    QDUINO_TRY_ASSIGN(const std::string_view name, object_name(command));
    if (word_value(command.text, "RESET")) {
        if (name.empty()) objects.include_all();
        if (!name.empty()) objects.include(name);
        return {};
    }
    if (!name.empty()) return left_out(objects.exclude(name));
    if (!word_value(command.text, "CURRENT"))
        return make_error(ErrorCode::invalid_argument, "needs NAME=…, CURRENT=1 or RESET=1");
    return leave_out_current(context);
}

/// M486 S: an object begins, or −1: ends. C: leave it out; P: that one; U: print it after all. In
/// this order, as Marlin does. T and A, their number and a name, change nothing.
Result<void> object_labels(Context& context, const Command& command) {
    Objects& objects = context.objects;
    QDUINO_TRY_ASSIGN(const auto begins, object_index(command, 'S'));
    QDUINO_TRY_ASSIGN(const auto leaves_out, object_index(command, 'P'));
    QDUINO_TRY_ASSIGN(const auto printed, object_index(command, 'U'));
    if (begins && *begins >= 0) objects.begin(numbered(*begins).view());
    if (begins && *begins < 0) objects.end();
    if (command.parameters.has('C')) QDUINO_TRY(leave_out_current(context));
    if (leaves_out) QDUINO_TRY(left_out(objects.exclude(numbered(*leaves_out).view())));
    if (printed) objects.include(numbered(*printed).view());
    return {};
}

}  // namespace qduino::printer::gcode::handlers
