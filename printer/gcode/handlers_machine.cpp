// Heaters, fans, limits, messages, reports, pauses: everything that the machine does besides
// moving.
#include <algorithm>
#include <cmath>

#include "printer/gcode/context.h"
#include "printer/gcode/text.h"

namespace qduino::printer::gcode::handlers {
namespace {

constexpr double kFanFull = 255;
constexpr std::uint8_t kFanIndexMax = 15;
constexpr double kAccelerationMin_mm_s2 = 0.1;
constexpr double kAccelerationMax_mm_s2 = 1e6;
constexpr double kJunctionDeviationMax_mm = 0.5;

Result<std::uint8_t> fan_index(const Command& command) {
    const auto index = number_within(command, 'P', 0, kFanIndexMax, "(the fan's number)");
    if (!index) return index.error();
    return static_cast<std::uint8_t>(index->value_or(0));
}

/// One limit of each axis, from a command's X, Y, Z, E. A job may make the machine slower than its
/// maker said, and never faster: a value above the configuration is cut to it, and `cut` names the
/// axis.
struct AxisLimits {
    PerAxis<std::optional<double>> values{};
    AxisSet cut;
};

Result<AxisLimits> take_axis_limits(const Command& command, double unit_mm, double minimum,
                                    const PerAxis<double>& maxima, std::string_view unit) {
    AxisLimits limits;
    for (const Axis axis : kAllAxes) {
        const auto given = number(command, kAxisLetter[axis]);
        if (!given) return given.error();
        if (!*given) continue;
        const double value = **given * unit_mm;
        if (!(value >= minimum)) {
            return outside(kAxisLetter[axis], value, minimum, maxima[axis], unit);
        }
        if (value > maxima[axis]) limits.cut.add(axis);
        limits.values[axis] = std::min(value, maxima[axis]);
    }
    return limits;
}

template <typename Member>
PerAxis<double> each_axis(const MachineConfig& machine, Member member) {
    PerAxis<double> values{};
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = (machine.axes[i].*member).value();
    return values;
}

template <typename Quantity>
void put(const AxisLimits& limits, PerAxis<std::optional<Quantity>>& out) {
    for (std::size_t i = 0; i < out.size(); ++i) {
        if (limits.values[i]) out[i] = Quantity{*limits.values[i]};
    }
}

FixedString<160> text_of_cut(const Command& command, const AxisLimits& limits) {
    FixedString<160> text{command.name().view()};
    for (const Axis axis : kAllAxes) {
        if (!limits.cut.contains(axis)) continue;
        text.push_back(' ').push_back(kAxisLetter[axis]).append(" kept at ");
        append_shortest(text, *limits.values[axis]);
    }
    return text.append(": this machine does no more");
}

/// Puts an acceleration into each of `targets` if it is given.
Result<void> take_acceleration(const Command& command, char letter, double unit_mm,
                               std::initializer_list<std::optional<MillimetresPerSecond2>*> targets) {
    const auto given = number(command, letter);
    if (!given) return given.error();
    if (!*given) return {};
    const double value = **given * unit_mm;
    if (!(value >= kAccelerationMin_mm_s2 && value <= kAccelerationMax_mm_s2)) {
        return outside(letter, value, kAccelerationMin_mm_s2, kAccelerationMax_mm_s2, "mm/s²");
    }
    for (auto* target : targets) *target = MillimetresPerSecond2{value};
    return {};
}

Result<void> check_tool(const Command& command) {
    const auto tool = number(command, 'T');
    if (!tool) return tool.error();
    if (tool->value_or(0) != 0) return make_error(ErrorCode::unsupported, "this machine has one tool, T0");
    return {};
}

}  // namespace

Result<void> heat(Context& context, const Command& command, Heater heater, bool wait) {
    const bool is_bed = heater == Heater::bed;
    if (!is_bed) {
        if (auto tool = check_tool(command); !tool) return tool;
    }
    const HeaterConfig& config = is_bed ? context.config.bed : context.config.hot_end;
    const bool present = !is_bed || context.config.has_bed;
    const double highest = highest_target(config).value();
    const std::string_view unit = is_bed ? "°C, what the bed may have" : "°C, what the hot end may have";
    const auto heating = number_within(command, 'S', 0, highest, unit);
    if (!heating) return heating.error();
    const auto either_way = number_within(command, 'R', 0, highest, unit);
    if (!either_way) return either_way.error();
    if (!*heating && !*either_way)
        return make_error(ErrorCode::invalid_argument, "needs S or R, a temperature");
    const Celsius target{*heating ? **heating : **either_way};
    if (!present) {
        if (target.value() > 0) return make_error(ErrorCode::unsupported, "this machine has no heated bed");
        return {};
    }
    if (!wait) return context.actions.set_temperature(heater, target);
    const WaitFor direction = *heating ? WaitFor::heating : WaitFor::heating_or_cooling;
    return context.actions.wait_temperature(heater, target, direction);
}

Result<void> hot_end(Context& i, const Command& c) { return heat(i, c, Heater::hot_end, false); }
Result<void> hot_end_wait(Context& i, const Command& c) { return heat(i, c, Heater::hot_end, true); }
Result<void> bed(Context& i, const Command& c) { return heat(i, c, Heater::bed, false); }
Result<void> bed_wait(Context& i, const Command& c) { return heat(i, c, Heater::bed, true); }

Result<void> fan_on(Context& context, const Command& command) {
    const auto index = fan_index(command);
    if (!index) return index.error();
    const auto speed = number_within(command, 'S', 0, kFanFull, "");
    if (!speed) return speed.error();
    return context.actions.set_fan(*index, speed->value_or(kFanFull) / kFanFull);
}

Result<void> fan_off(Context& context, const Command& command) {
    const auto index = fan_index(command);
    return index ? context.actions.set_fan(*index, 0) : Result<void>{index.error()};
}

Result<void> motors_off(Context& context, const Command& command) {
    if (command.parameters.has('S')) {
        context.warn("the idle time S of M18 and M84 is not yet done: skipped");
        return {};
    }
    AxisSet axes;
    for (const Axis axis : kAllAxes) {
        if (command.parameters.has(kAxisLetter[axis])) axes.add(axis);
    }
    if (axes.empty()) axes = AxisSet::all();
    if (auto done = context.actions.motors_off(axes); !done) return done;
    for (const Axis axis : kToolAxes) {
        if (axes.contains(axis)) context.state.set_homed(axis, false);
    }
    return {};
}

Result<void> axis_accelerations(Context& context, const Command& command) {
    const auto maxima = each_axis(context.config, &AxisConfig::max_acceleration);
    const auto limits =
        take_axis_limits(command, context.state.unit_mm, kAccelerationMin_mm_s2, maxima, "mm/s²");
    if (!limits) return limits.error();
    LimitChange change;
    put(*limits, change.axis_acceleration);
    if (!limits->cut.empty()) context.warn(text_of_cut(command, *limits));
    return context.actions.set_limits(change);
}

Result<void> axis_speeds(Context& context, const Command& command) {
    const auto maxima = each_axis(context.config, &AxisConfig::max_speed);
    const auto limits = take_axis_limits(command, context.state.unit_mm, kSlowest.value(), maxima, "mm/s");
    if (!limits) return limits.error();
    LimitChange change;
    put(*limits, change.axis_speed);
    if (!limits->cut.empty()) context.warn(text_of_cut(command, *limits));
    return context.actions.set_limits(change);
}

Result<void> accelerations(Context& context, const Command& command) {
    LimitChange change;
    const double unit = context.state.unit_mm;
    // S is the older form of P and T together, and gives way to them.
    if (auto r =
            take_acceleration(command, 'S', unit, {&change.print_acceleration, &change.travel_acceleration});
        !r) {
        return r;
    }
    if (auto r = take_acceleration(command, 'P', unit, {&change.print_acceleration}); !r) return r;
    if (auto r = take_acceleration(command, 'R', unit, {&change.filament_acceleration}); !r) return r;
    if (auto r = take_acceleration(command, 'T', unit, {&change.travel_acceleration}); !r) return r;
    return context.actions.set_limits(change);
}

Result<void> instantaneous_speeds(Context& context, const Command& command) {
    const auto maxima = each_axis(context.config, &AxisConfig::instantaneous_speed);
    const double unit = context.state.unit_mm;
    const auto limits = take_axis_limits(command, unit, 0, maxima, "mm/s");
    if (!limits) return limits.error();
    const auto deviation = number(command, 'J');
    if (!deviation) return deviation.error();
    LimitChange change;
    put(*limits, change.axis_instantaneous_speed);
    if (*deviation) {
        const double value = **deviation * unit;
        if (!(value > 0 && value <= kJunctionDeviationMax_mm)) {
            return outside('J', value, 0, kJunctionDeviationMax_mm, "mm");
        }
        change.junction_deviation = Millimetres{value};
    }
    if (!limits->cut.empty()) context.warn(text_of_cut(command, *limits));
    return context.actions.set_limits(change);
}

Result<void> message(Context& context, const Command& command) {
    context.actions.message(command.text);
    return {};
}

Result<void> echo(Context& context, const Command& command) {
    context.actions.note(NoteKind::echo, command.text, command.source);
    return {};
}

Result<void> progress(Context& context, const Command& command) {
    const auto percent = number_within(command, 'P', 0, 100, "percent");
    if (!percent) return percent.error();
    const auto minutes = number_within(command, 'R', 0, 1e6, "minutes");
    if (!minutes) return minutes.error();
    Progress progress;
    progress.percent = *percent;
    if (*minutes) progress.remaining = Seconds{**minutes * 60};
    context.actions.progress(progress);
    return {};
}

Result<void> report_temperatures(Context& context, const Command&) {
    context.actions.report(Report::temperatures);
    return {};
}

Result<void> report_position(Context& context, const Command&) {
    context.actions.report(Report::position);
    return {};
}

Result<void> report_firmware(Context& context, const Command& command) {
    // PrusaSlicer writes `M115 U3.13.3`, "this version or newer": a check that must not fail, and
    // asks for nothing.
    const std::string_view text = command.text;
    const bool is_version_check = !text.empty() && to_upper(text.front()) == 'U';
    if (!is_version_check) context.actions.report(Report::firmware);
    return {};
}

/// The limit is the machine file's: a job that could lift it would grind its filament.
Result<void> cold_extrusion(Context& context, const Command& command) {
    if (!command.parameters.empty()) {
        context.warn("M302 changes nothing: minimum_extrude_celsius of the machine file is the limit");
    }
    const double lowest = context.config.minimum_extrude.value();
    FixedString<80> text{"Cold extrudes are "};
    text.append(lowest > 0 ? "disabled (min temp " : "enabled (min temp ");
    context.actions.note(NoteKind::echo, append_shortest(text, lowest).append("C)"), command.source);
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
    return context.actions.pause(PauseReason::requested, command.text);
}

Result<void> pause(Context& context, const Command&) {
    return context.actions.pause(PauseReason::requested, {});
}

Result<void> filament_change(Context& context, const Command&) {
    return context.actions.pause(PauseReason::filament_change, {});
}

Result<void> emergency_stop(Context& context, const Command&) {
    context.actions.emergency_stop();
    return {};
}

}  // namespace qduino::printer::gcode::handlers
