// Heaters, fans, limits, messages, reports, pauses: everything that the machine does besides
// moving.
#include <algorithm>
#include <cmath>

#include "printer/gcode/context.h"
#include "printer/gcode/text.h"

namespace qduino::printer::gcode::handlers {
namespace {

constexpr double kFanFull = 255;
constexpr std::uint8_t kFanIndexMax = 255;  // other machines number chamber fans from 100 on
constexpr double kJunctionDeviationMax_mm = 0.5;
/// The largest park place or filament length that is taken, in the unit of the job (mm or inch);
/// more is a typing error.
constexpr double kParkMax = 1000;

Result<std::uint8_t> fan_index(const Command& command) {
    QDUINO_TRY_ASSIGN(const auto index, number_within(command, 'P', 0, kFanIndexMax, "(the fan's number)"));
    return static_cast<std::uint8_t>(index.value_or(0));
}

/// One limit of each axis, from a command's X, Y, Z, E, handed on with `change`. A job may make the
/// machine slower than its maker said, and never faster: a value above the configuration is cut to
/// it, and a warning names the axis.
template <typename Quantity>
Result<void> limit_axes(Context& context, const Command& command, LimitChange change,
                        PerAxis<std::optional<Quantity>> LimitChange::*limits,
                        Quantity AxisConfig::*configured, double minimum, std::string_view unit) {
    FixedString<160> cut;
    for (const Axis axis : kAllAxes) {
        QDUINO_TRY_ASSIGN(const auto given, number(command, kAxisLetter[axis]));
        if (!given) continue;
        const double value = *given * context.state.unit_mm;
        const double maximum = (context.config.axes[axis].*configured).value();
        if (!(value >= minimum)) return outside(kAxisLetter[axis], value, minimum, maximum, unit);
        if (value > maximum) write(cut, ' ', kAxisLetter[axis], " kept at ", Shortest{maximum});
        (change.*limits)[axis] = Quantity{std::min(value, maximum)};
    }
    if (!cut.empty()) context.warn(text(command.name(), cut, ": this machine does no more"));
    return context.actions.set_limits(change);
}

/// True when `letter` names a tool that is not there.
Result<bool> is_absent_tool(const Command& command, char letter) {
    QDUINO_TRY_ASSIGN(const auto tool, number(command, letter));
    return tool.value_or(0) != 0;
}

}  // namespace
}  // namespace qduino::printer::gcode::handlers

namespace qduino::printer::gcode {

Result<void> set_target(Context& context, Heater heater, Celsius target, std::optional<WaitFor> wait) {
    if (heater == Heater::bed && !context.config.has_bed) {
        if (target.value() > 0) return make_error(ErrorCode::unsupported, "this machine has no heated bed");
        return {};
    }
    QDUINO_TRY(wait ? context.actions.wait_temperature(heater, target, *wait)
                    : context.actions.set_temperature(heater, target));
    (heater == Heater::bed ? context.state.bed_target : context.state.hot_end_target) = target;
    return {};
}

Result<void> set_tool_temperature(Context& context, const Command& command, char tool_letter) {
    const double highest = highest_target(context.config.hot_end).value();
    QDUINO_TRY_ASSIGN(const bool absent, handlers::is_absent_tool(command, tool_letter));
    QDUINO_TRY_ASSIGN(const auto target,
                      number_within(command, 'S', 0, highest, "°C, what the hot end may have"));
    if (!target) return {};
    if (!absent) return set_target(context, Heater::hot_end, Celsius{*target});
    if (*target > 0) return make_error(ErrorCode::unsupported, "this machine has one tool, T0");
    return {};
}

}  // namespace qduino::printer::gcode

namespace qduino::printer::gcode::handlers {

Result<void> heat(Context& context, const Command& command, Heater heater, bool wait) {
    const bool is_bed = heater == Heater::bed;
    const HeaterConfig& config = is_bed ? context.config.bed : context.config.hot_end;
    const double highest = highest_target(config).value();
    const std::string_view unit = is_bed ? "°C, what the bed may have" : "°C, what the hot end may have";
    QDUINO_TRY_ASSIGN(const bool absent, is_absent_tool(command, 'T'));
    QDUINO_TRY_ASSIGN(const auto heating, number_within(command, 'S', 0, highest, unit));
    QDUINO_TRY_ASSIGN(const auto either_way, number_within(command, 'R', 0, highest, unit));
    if (!heating && !either_way && !wait)
        return make_error(ErrorCode::invalid_argument, "needs S or R, a temperature");
    // M109 by itself waits for the target in force.
    const Celsius now = is_bed ? context.state.bed_target : context.state.hot_end_target;
    const Celsius target{heating.value_or(either_way.value_or(now.value()))};
    if (!is_bed && absent) {  // to switch off what is not there changes nothing
        if (target.value() <= 0) return {};
        return make_error(ErrorCode::unsupported, "this machine has one tool, T0");
    }
    if (!wait) return set_target(context, heater, target);
    const bool named = heating || either_way;
    if (!named && target.value() <= 0) return {};
    return set_target(context, heater, target,
                      heating || !named ? WaitFor::heating : WaitFor::heating_or_cooling);
}

/// M116: what M190 and M109 would do for the targets in force.
Result<void> wait_for_heat(Context& context, const Command&) {
    const ModalState& state = context.state;
    return context.lines.begin("M116",
                               text("M190 S", Shortest{state.bed_target.value()}, "\nM109 S",
                                    Shortest{state.hot_end_target.value()}),
                               {});
}

Result<void> refused(Context&, const Command& command) {
    const CodeInfo* const code = find_code(command);
    return make_error(ErrorCode::unsupported, "this printer does not do it (",
                      code != nullptr ? code->name : "unknown", "), and cannot leave it out");
}

Result<void> hot_end(Context& i, const Command& c) { return heat(i, c, Heater::hot_end, false); }
/// RepRapFirmware's M568 P S R: as its G10.
Result<void> tool_temperatures(Context& i, const Command& c) { return set_tool_temperature(i, c, 'P'); }

Result<void> hot_end_wait(Context& i, const Command& c) { return heat(i, c, Heater::hot_end, true); }
Result<void> bed(Context& i, const Command& c) { return heat(i, c, Heater::bed, false); }
Result<void> bed_wait(Context& i, const Command& c) { return heat(i, c, Heater::bed, true); }

Result<void> fan_on(Context& context, const Command& command) {
    QDUINO_TRY_ASSIGN(const auto index, fan_index(command));
    QDUINO_TRY_ASSIGN(const auto speed, number_within(command, 'S', 0, kFanFull, ""));
    return context.actions.set_fan(index, speed.value_or(kFanFull) / kFanFull);
}

Result<void> fan_off(Context& context, const Command& command) {
    QDUINO_TRY_ASSIGN(const auto index, fan_index(command));
    return context.actions.set_fan(index, 0);
}

Result<void> motors_off(Context& context, const Command& command) {
    QDUINO_TRY_ASSIGN(const auto after, number_within(command, 'S', 0, kLongestDwell.value(), "s"));
    if (after) return context.actions.motors_time_out(Seconds{*after});
    const AxisSet axes = axes_of(command, AxisSet::all());
    const auto goes_off = [&](Axis axis) { return context.kinematics.shares_motor(axis, axes); };
    if (std::ranges::any_of(kToolAxes, goes_off)) QDUINO_TRY(context.settle());
    QDUINO_TRY(context.actions.motors_off(axes));
    for (const Axis axis : kToolAxes) {
        if (goes_off(axis)) context.state.set_homed(axis, false);
    }
    return {};
}

Result<void> axis_accelerations(Context& context, const Command& command) {
    return limit_axes(context, command, {}, &LimitChange::axis_acceleration, &AxisConfig::max_acceleration,
                      kAccelerationMin_mm_s2, "mm/s²");
}

Result<void> axis_speeds(Context& context, const Command& command) {
    return limit_axes(context, command, {}, &LimitChange::axis_speed, &AxisConfig::max_speed,
                      kSlowest.value(), "mm/s");
}

Result<void> accelerations(Context& context, const Command& command) {
    LimitChange change;
    const auto take = [&](char letter, auto& target) {
        return take_scaled(command, letter, context.state.unit_mm, kAccelerationMin_mm_s2,
                           kAccelerationMax_mm_s2, target, "mm/s²");
    };
    // S is the older form of P and T together, and gives way to them.
    QDUINO_TRY(take('S', change.print_acceleration));
    change.travel_acceleration = change.print_acceleration;
    QDUINO_TRY(take('P', change.print_acceleration));
    QDUINO_TRY(take('R', change.filament_acceleration));
    QDUINO_TRY(take('T', change.travel_acceleration));
    return context.actions.set_limits(change);
}

Result<void> instantaneous_speeds(Context& context, const Command& command) {
    QDUINO_TRY_ASSIGN(const auto deviation, number(command, 'J'));
    LimitChange change;
    if (deviation) {
        const double value = *deviation * context.state.unit_mm;
        if (!(value > 0 && value <= kJunctionDeviationMax_mm))
            return outside('J', value, 0, kJunctionDeviationMax_mm, "mm");
        change.junction_deviation = Millimetres{value};
    }
    return limit_axes(context, command, change, &LimitChange::axis_instantaneous_speed,
                      &AxisConfig::instantaneous_speed, 0, "mm/s");
}

void message(Context& context, const Command& command) { context.actions.message(command.text); }

/// Up to three letters in front say how it is told: A1 as a host's action, E1 and P0 not at all.
void echo(Context& context, const Command& command) {
    std::string_view rest = command.text.view();
    bool is_action = false;
    for (int letters = 0; letters < 3 && rest.size() >= 2; ++letters) {
        const char letter = rest[0];
        const bool is_one = (letter == 'A' || letter == 'E') && rest[1] == '1';
        const bool is_port = letter == 'P' && is_digit(rest[1]);
        if (!is_one && !is_port) break;
        is_action = is_action || letter == 'A';
        rest = trim(rest.substr(2));
    }
    context.actions.note(NoteKind::echo, text(is_action ? "//" : "", rest), command.source);
}

/// A display: what makes no sense is not shown, and fails nothing.
void progress(Context& context, const Command& command) {
    constexpr double kMinutesMax = 1e6;
    const auto percent = command.parameters.value('P');
    const auto minutes = command.parameters.value('R');
    Progress shown;
    if (percent) shown.percent = std::clamp(*percent, 0.0, 100.0);
    if (minutes && *minutes >= 0 && *minutes <= kMinutesMax) shown.remaining = Seconds{*minutes * 60};
    if (shown.percent || shown.remaining) context.actions.progress(shown);
    if (command.parameters.empty() && command.text.empty()) context.actions.report(Report::progress);
}

void report_temperatures(Context& context, const Command&) { context.actions.report(Report::temperatures); }

void report_position(Context& context, const Command&) { context.actions.report(Report::position); }

void report_firmware(Context& context, const Command& command) {
    // PrusaSlicer writes `M115 U3.13.3`, "this version or newer": a check that must not fail, and
    // asks for nothing.
    const std::string_view text = command.text;
    const bool is_version_check = !text.empty() && to_upper(text.front()) == 'U';
    if (!is_version_check) context.actions.report(Report::firmware);
}

/// M302: S is the least temperature at which filament moves, for the job; P1 is the lowest there
/// is, and P0 the machine file's. Filament that is pushed cold is ground, so the machine file has a
/// floor.
Result<void> cold_extrusion(Context& context, const Command& command) {
    const MachineConfig& machine = context.config;
    const double highest = highest_target(machine.hot_end).value();
    QDUINO_TRY_ASSIGN(const auto allowed, number(command, 'P'));
    QDUINO_TRY_ASSIGN(const auto least, number_within(command, 'S', 0, highest, "°C"));
    if (allowed || least) {
        const Celsius floor = std::min(machine.minimum_extrude_floor, machine.minimum_extrude);
        const Celsius asked = least                      ? Celsius{*least}
                              : allowed.value_or(0) != 0 ? floor
                                                         : machine.minimum_extrude;
        context.state.minimum_extrude = std::max(asked, floor);
        if (asked < floor) {
            context.warn(text("M302: filament moves from ", Shortest{floor.value()}, " °C on, and not from ",
                              Shortest{asked.value()},
                              " °C (minimum_extrude_floor_celsius of the machine file)"));
        }
        return context.actions.set_limits({.minimum_extrude = context.state.minimum_extrude});
    }
    const double lowest = context.state.minimum_extrude.value();
    context.actions.note(NoteKind::echo,
                         text("Cold extrudes are ", lowest > 0 ? "disabled" : "enabled", " (min temp ",
                              Shortest{lowest}, "C)"),
                         command.source);
    return {};
}

Result<void> stop(Context& context, const Command& command) {
    // `M0 S10` and `M0 P500` wait that long; anything else, with or without text, waits for a
    // person.
    std::string_view rest = command.text;
    const char letter = rest.empty() ? '\0' : to_upper(rest.front());
    if (letter == 'S' || letter == 'P') {
        rest.remove_prefix(1);
        const auto value = take_number(rest);
        const double seconds = value.value_or(0) / (letter == 'P' ? 1000 : 1);
        if (value && trim(rest).empty() && seconds > 0) {
            if (!(seconds <= kLongestDwell.value()))
                return outside(letter, seconds, 0, kLongestDwell.value(), "s");
            return context.actions.dwell(Seconds{seconds});
        }
    }
    return context.actions.pause({.text = command.text});
}

Result<void> pause(Context& context, const Command&) { return context.actions.pause({}); }

/// M125 and M600: X and Y of the park place, Z up before it, and lengths of filament. Hosts write
/// lengths with either sign.
Result<void> pause_elsewhere(Context& context, const Command& command, PauseOrder order, char retract) {
    const auto take = [&](char letter, std::optional<Millimetres>& length, bool sign) -> Result<void> {
        QDUINO_TRY_ASSIGN(const auto given, number_within(command, letter, -kParkMax, kParkMax, ""));
        const double mm = given.value_or(0) * context.state.unit_mm;
        if (given) length = Millimetres{sign ? mm : std::abs(mm)};
        return {};
    };
    QDUINO_TRY(take('X', order.x, true));
    QDUINO_TRY(take('Y', order.y, true));
    QDUINO_TRY(take('Z', order.lift, false));
    QDUINO_TRY(take(retract, order.retract, false));
    if (order.reason == PauseReason::filament_change) {
        QDUINO_TRY(take('U', order.unload, false));
        QDUINO_TRY(take('L', order.purge, false));
    }
    return context.actions.pause(order);
}

Result<void> park(Context& i, const Command& c) { return pause_elsewhere(i, c, {}, 'L'); }

Result<void> filament_change(Context& i, const Command& c) {
    return pause_elsewhere(i, c, {.reason = PauseReason::filament_change}, 'E');
}

/// RS274: nothing behind it counts. M30 with a name is Marlin's: delete that file.
Result<void> end_program(Context& context, const Command& command) {
    context.not_done = command.number == 30 && !command.text.empty();
    if (context.not_done) return {};
    context.program_ended = true;
    context.lines.clear();
    return {};
}

void emergency_stop(Context& context, const Command&) { context.actions.emergency_stop(); }

}  // namespace qduino::printer::gcode::handlers
