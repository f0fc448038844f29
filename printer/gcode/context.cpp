#include "printer/gcode/context.h"

#include <algorithm>
#include <cmath>

#include "printer/gcode/text.h"

namespace qduino::printer::gcode {
namespace {

Error outside_bounds(Axis axis, Millimetres target, const AxisConfig& config) {
    FixedString<236> text;
    text.push_back(kAxisLetter[axis]).append(" would go to ");
    append_shortest(text, target.value()).append(" mm; this machine reaches from ");
    append_shortest(text, config.minimum.value()).append(" to ");
    append_shortest(text, config.maximum.value()).append(" mm");
    return make_error(ErrorCode::out_of_range, text);
}

}  // namespace

Result<void> Context::move_to(const Position& target, MillimetresPerSecond feedrate, bool firmware_retract) {
    if (target == state.machine) return {};
    Move move;
    move.from = state.machine;
    move.to = target;
    move.feedrate = std::clamp(feedrate * state.speed_factor, kSlowest, kFastest);
    move.firmware_retract = firmware_retract;
    move.source = source;
    const bool tool_moves = std::any_of(kToolAxes.begin(), kToolAxes.end(),
                                        [&](Axis axis) { return move.from[axis] != move.to[axis]; });
    if (!tool_moves) {
        move.kind = MoveKind::filament;
    } else {
        move.kind = move.from[Axis::e] == move.to[Axis::e] ? MoveKind::travel : MoveKind::print;
    }
    warn_unhomed(target);
    auto accepted = actions.move(move);
    if (accepted) state.machine = target;
    return accepted;
}

Result<void> Context::check_target(Position& target) const {
    for (const Axis axis : kToolAxes) {
        // An axis that stands still breaks no bound.
        if (target[axis] == state.machine[axis]) continue;
        const Millimetres low = config.axes[axis].minimum;
        const Millimetres high = config.axes[axis].maximum;
        const bool inside = target[axis] >= low - kBoundsTolerance && target[axis] <= high + kBoundsTolerance;
        if (!inside) return outside_bounds(axis, target[axis], config.axes[axis]);
        target[axis] = std::clamp(target[axis], low, high);
    }
    const double extruded_mm = (target[Axis::e] - state.machine[Axis::e]).value();
    if (!(std::abs(extruded_mm) <= kLongestExtrusion.value())) {
        return outside('E', extruded_mm, -kLongestExtrusion.value(), kLongestExtrusion.value(),
                       "mm in one move (is a G92 E0 missing?)");
    }
    return {};
}

void Context::warn(std::string_view text) {
    ++warnings;
    actions.note(NoteKind::warning, text, source);
}

void Context::warn_unhomed(const Position& target) {
    for (const Axis axis : kToolAxes) {
        if (state.homed[axis] || state.warned_unhomed[axis] || target[axis] == state.machine[axis]) continue;
        state.warned_unhomed[axis] = true;
        FixedString<128> text;
        text.push_back(kAxisLetter[axis])
            .append(" moves without having been homed (G28): its place is assumed");
        warn(text);
    }
}

Result<std::optional<double>> number(const Command& command, char letter) {
    const auto value = command.parameters.value(letter);
    if (!value && command.parameters.has(letter)) {
        FixedString<64> text;
        text.push_back(letter).append(" needs a number behind it");
        return make_error(ErrorCode::invalid_argument, text);
    }
    return value;
}

Result<std::optional<double>> number_within(const Command& command, char letter, double low, double high,
                                            std::string_view unit) {
    auto value = number(command, letter);
    if (value && *value && !(**value >= low && **value <= high))
        return outside(letter, **value, low, high, unit);
    return value;
}

Error outside(char letter, double value, double low, double high, std::string_view unit) {
    FixedString<236> text;
    text.push_back(letter);
    append_shortest(text, value).append(" is outside of ");
    append_shortest(text, low).append(" to ");
    append_shortest(text, high).push_back(' ').append(unit);
    return make_error(ErrorCode::out_of_range, text);
}

}  // namespace qduino::printer::gcode
