// Heaters, fans, limits, messages, reports, pauses: what the machine does besides moving.
#include <algorithm>
#include <cmath>

#include "printer/gcode/handlers.h"

namespace qduino::printer::gcode {
namespace {

constexpr double kFanFull = 255;
constexpr std::uint8_t kFanIndexMax = 15;
constexpr double kAccelerationMin_mm_s2 = 0.1;
constexpr double kAccelerationMax_mm_s2 = 1e6;
constexpr double kJunctionDeviationMax_mm = 0.5;

Result<std::uint8_t> fan_index(const Command& command) {
    const auto index = Handlers::number_within(command, 'P', 0, kFanIndexMax, "(the fan's number)");
    if (!index) return index.error();
    return static_cast<std::uint8_t>(index->value_or(0));
}

/// One limit of each axis from a command's X, Y, Z, E. A job may make the machine slower than its maker
/// said, never faster: what is above the configuration is cut to it, and `cut` names the axis.
struct AxisLimits {
    std::array<std::optional<double>, kAxisCount> values{};
    AxisSet cut;
};

Result<AxisLimits> take_axis_limits(const Command& command, double unit_mm, double minimum,
                                    const std::array<double, kAxisCount>& maxima, std::string_view unit) {
    AxisLimits limits;
    for (const Axis axis : kAllAxes) {
        const auto index = static_cast<std::size_t>(axis);
        const auto given = Handlers::number(command, kAxisLetter[index]);
        if (!given) return given.error();
        if (!*given) continue;
        const double value = **given * unit_mm;
        if (!(value >= minimum)) {
            return Handlers::outside(kAxisLetter[index], value, minimum, maxima[index], unit);
        }
        if (value > maxima[index]) limits.cut.add(axis);
        limits.values[index] = std::min(value, maxima[index]);
    }
    return limits;
}

template <typename Member>
std::array<double, kAxisCount> each_axis(const MachineConfig& machine, Member member) {
    std::array<double, kAxisCount> values{};
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = machine.axes[i].*member;
    return values;
}

template <typename Quantity>
void put(const AxisLimits& limits, std::array<std::optional<Quantity>, kAxisCount>& out) {
    for (std::size_t i = 0; i < out.size(); ++i) {
        if (limits.values[i]) out[i] = Quantity{*limits.values[i]};
    }
}

FixedString<160> text_of_cut(const Command& command, const AxisLimits& limits) {
    FixedString<160> text{command.name().view()};
    for (const Axis axis : kAllAxes) {
        const auto index = static_cast<std::size_t>(axis);
        if (!limits.cut.contains(axis)) continue;
        text.push_back(' ').push_back(kAxisLetter[index]).append(" kept at ");
        append_shortest(text, *limits.values[index]);
    }
    return text.append(": this machine does no more");
}

/// Puts an acceleration into each of `targets` if it is given.
Result<void> take_acceleration(const Command& command, char letter, double unit_mm,
                               std::initializer_list<std::optional<MillimetresPerSecond2>*> targets) {
    const auto given = Handlers::number(command, letter);
    if (!given) return given.error();
    if (!*given) return {};
    const double value = **given * unit_mm;
    if (!(value >= kAccelerationMin_mm_s2 && value <= kAccelerationMax_mm_s2)) {
        return Handlers::outside(letter, value, kAccelerationMin_mm_s2, kAccelerationMax_mm_s2, "mm/s²");
    }
    for (auto* target : targets) *target = MillimetresPerSecond2{value};
    return {};
}

Result<void> check_tool(const Command& command) {
    const auto tool = Handlers::number(command, 'T');
    if (!tool) return tool.error();
    if (tool->value_or(0) != 0) return make_error(ErrorCode::unsupported, "this machine has one tool, T0");
    return {};
}

}  // namespace

Result<void> Handlers::heat(Interpreter& interpreter, const Command& command, Heater heater, bool wait) {
    const bool is_bed = heater == Heater::bed;
    if (!is_bed) {
        if (auto tool = check_tool(command); !tool) return tool;
    }
    const HeaterConfig& config = is_bed ? interpreter.config_.bed : interpreter.config_.hot_end;
    const bool present = !is_bed || interpreter.config_.has_bed;
    const double highest = config.maximum_celsius - kTargetMarginCelsius;
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
    if (!wait) return interpreter.actions_.set_temperature(heater, target);
    const WaitFor direction = *heating ? WaitFor::heating : WaitFor::heating_or_cooling;
    return interpreter.actions_.wait_temperature(heater, target, direction);
}

Result<void> Handlers::hot_end(Interpreter& i, const Command& c) {
    return heat(i, c, Heater::hot_end, false);
}
Result<void> Handlers::hot_end_wait(Interpreter& i, const Command& c) {
    return heat(i, c, Heater::hot_end, true);
}
Result<void> Handlers::bed(Interpreter& i, const Command& c) { return heat(i, c, Heater::bed, false); }
Result<void> Handlers::bed_wait(Interpreter& i, const Command& c) { return heat(i, c, Heater::bed, true); }

Result<void> Handlers::fan_on(Interpreter& interpreter, const Command& command) {
    const auto index = fan_index(command);
    if (!index) return index.error();
    const auto speed = number_within(command, 'S', 0, kFanFull, "");
    if (!speed) return speed.error();
    return interpreter.actions_.set_fan(*index, speed->value_or(kFanFull) / kFanFull);
}

Result<void> Handlers::fan_off(Interpreter& interpreter, const Command& command) {
    const auto index = fan_index(command);
    return index ? interpreter.actions_.set_fan(*index, 0) : Result<void>{index.error()};
}

Result<void> Handlers::motors_off(Interpreter& interpreter, const Command& command) {
    if (command.parameters.has('S')) {
        interpreter.warn("the idle time S of M18 and M84 is not yet done: skipped");
        return {};
    }
    AxisSet axes;
    for (const Axis axis : kAllAxes) {
        if (command.parameters.has(kAxisLetter[static_cast<std::size_t>(axis)])) axes.add(axis);
    }
    if (axes.empty()) axes = AxisSet::all();
    if (auto done = interpreter.actions_.motors_off(axes); !done) return done;
    for (const Axis axis : kToolAxes) {
        if (axes.contains(axis)) interpreter.set_homed(axis, false);
    }
    return {};
}

Result<void> Handlers::axis_accelerations(Interpreter& interpreter, const Command& command) {
    const auto maxima = each_axis(interpreter.config_, &AxisConfig::max_acceleration_mm_s2);
    const auto limits =
        take_axis_limits(command, interpreter.state_.unit_mm, kAccelerationMin_mm_s2, maxima, "mm/s²");
    if (!limits) return limits.error();
    LimitChange change;
    put(*limits, change.axis_acceleration);
    if (!limits->cut.empty()) interpreter.warn(text_of_cut(command, *limits));
    return interpreter.actions_.set_limits(change);
}

Result<void> Handlers::axis_speeds(Interpreter& interpreter, const Command& command) {
    const auto maxima = each_axis(interpreter.config_, &AxisConfig::max_speed_mm_s);
    const auto limits =
        take_axis_limits(command, interpreter.state_.unit_mm, kSlowest.value(), maxima, "mm/s");
    if (!limits) return limits.error();
    LimitChange change;
    put(*limits, change.axis_speed);
    if (!limits->cut.empty()) interpreter.warn(text_of_cut(command, *limits));
    return interpreter.actions_.set_limits(change);
}

Result<void> Handlers::accelerations(Interpreter& interpreter, const Command& command) {
    LimitChange change;
    const double unit = interpreter.state_.unit_mm;
    // S is the older form of P and T together, and gives way to them.
    if (auto r =
            take_acceleration(command, 'S', unit, {&change.print_acceleration, &change.travel_acceleration});
        !r) {
        return r;
    }
    if (auto r = take_acceleration(command, 'P', unit, {&change.print_acceleration}); !r) return r;
    if (auto r = take_acceleration(command, 'R', unit, {&change.filament_acceleration}); !r) return r;
    if (auto r = take_acceleration(command, 'T', unit, {&change.travel_acceleration}); !r) return r;
    return interpreter.actions_.set_limits(change);
}

Result<void> Handlers::instantaneous_speeds(Interpreter& interpreter, const Command& command) {
    const auto maxima = each_axis(interpreter.config_, &AxisConfig::instantaneous_speed_mm_s);
    const double unit = interpreter.state_.unit_mm;
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
    if (!limits->cut.empty()) interpreter.warn(text_of_cut(command, *limits));
    return interpreter.actions_.set_limits(change);
}

Result<void> Handlers::message(Interpreter& interpreter, const Command& command) {
    interpreter.actions_.message(command.text);
    return {};
}

Result<void> Handlers::echo(Interpreter& interpreter, const Command& command) {
    interpreter.actions_.note(NoteKind::echo, command.text, command.source);
    return {};
}

Result<void> Handlers::progress(Interpreter& interpreter, const Command& command) {
    const auto percent = number_within(command, 'P', 0, 100, "percent");
    if (!percent) return percent.error();
    const auto minutes = number_within(command, 'R', 0, 1e6, "minutes");
    if (!minutes) return minutes.error();
    Progress progress;
    progress.percent = *percent;
    if (*minutes) progress.remaining = Seconds{**minutes * 60};
    interpreter.actions_.progress(progress);
    return {};
}

Result<void> Handlers::report_temperatures(Interpreter& interpreter, const Command&) {
    interpreter.actions_.report(Report::temperatures);
    return {};
}

Result<void> Handlers::report_position(Interpreter& interpreter, const Command&) {
    interpreter.actions_.report(Report::position);
    return {};
}

Result<void> Handlers::report_firmware(Interpreter& interpreter, const Command& command) {
    // PrusaSlicer writes `M115 U3.13.3`, "this version or newer": a check that must not fail, and asks for
    // nothing.
    const std::string_view text = command.text;
    const bool is_version_check = !text.empty() && to_upper(text.front()) == 'U';
    if (!is_version_check) interpreter.actions_.report(Report::firmware);
    return {};
}

Result<void> Handlers::stop(Interpreter& interpreter, const Command& command) {
    // `M0 S10` and `M0 P500` wait that long; anything else, with or without text, waits for a person.
    std::string_view rest = command.text;
    const char letter = rest.empty() ? '\0' : to_upper(rest.front());
    if (letter == 'S' || letter == 'P') {
        rest.remove_prefix(1);
        const auto value = take_number(rest);
        const double seconds = value.value_or(0) / (letter == 'P' ? 1000 : 1);
        if (value && trim(rest).empty() && seconds > 0) {
            if (!(seconds <= kLongestDwell.value()))
                return outside(letter, seconds, 0, kLongestDwell.value(), "s");
            return interpreter.actions_.dwell(Seconds{seconds});
        }
    }
    return interpreter.actions_.pause(PauseReason::requested, command.text);
}

Result<void> Handlers::pause(Interpreter& interpreter, const Command&) {
    return interpreter.actions_.pause(PauseReason::requested, {});
}

Result<void> Handlers::filament_change(Interpreter& interpreter, const Command&) {
    return interpreter.actions_.pause(PauseReason::filament_change, {});
}

Result<void> Handlers::emergency_stop(Interpreter& interpreter, const Command&) {
    interpreter.actions_.emergency_stop();
    return {};
}

}  // namespace qduino::printer::gcode
