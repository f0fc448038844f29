#include "printer/gcode/context.h"

#include <algorithm>
#include <cmath>

namespace qduino::printer::gcode {
Result<void> Context::move_to(const Position& target, MillimetresPerSecond feedrate, bool firmware_retract) {
    if (target == state.machine) return {};
    const auto moves = [&](Axis axis) { return state.machine[axis] != target[axis]; };
    const MoveKind kind = !std::ranges::any_of(kToolAxes, moves) ? MoveKind::filament
                          : moves(Axis::e)                       ? MoveKind::print
                                                                 : MoveKind::travel;
    warn_unhomed(target);
    QDUINO_TRY(
        actions.move({state.machine, target, std::clamp(feedrate * state.speed_factor, kSlowest, kFastest),
                      kind, firmware_retract, source}));
    state.machine = target;
    return {};
}

Result<void> Context::check_target(Position& target) const {
    for (const Axis axis : kToolAxes) {
        // An axis that stands still breaks no bound.
        if (target[axis] == state.machine[axis]) continue;
        const Millimetres low = config.axes[axis].minimum;
        const Millimetres high = config.axes[axis].maximum;
        const bool inside = target[axis] >= low - kBoundsTolerance && target[axis] <= high + kBoundsTolerance;
        if (!inside) {
            return make_error(ErrorCode::out_of_range, kAxisLetter[axis], " would go to ",
                              Shortest{target[axis].value()}, " mm; this machine reaches from ",
                              Shortest{low.value()}, " to ", Shortest{high.value()}, " mm");
        }
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
        warn(text(kAxisLetter[axis], " moves without having been homed (G28): its place is assumed"));
    }
}

Result<std::optional<double>> number(const Command& command, char letter) {
    const auto value = command.parameters.value(letter);
    if (!value && command.parameters.has(letter))
        return make_error(ErrorCode::invalid_argument, letter, " needs a number behind it");
    return value;
}

Result<std::optional<double>> number_within(const Command& command, char letter, double low, double high,
                                            std::string_view unit) {
    auto value = number(command, letter);
    if (value && *value && !(**value >= low && **value <= high))
        return outside(letter, **value, low, high, unit);
    return value;
}

AxisSet axes_of(const Command& command, AxisSet otherwise) {
    AxisSet axes;
    for (const Axis axis : kAllAxes)
        if (command.parameters.has(kAxisLetter[axis])) axes.add(axis);
    return axes.empty() ? otherwise : axes;
}

Error outside(char letter, double value, double low, double high, std::string_view unit) {
    return make_error(ErrorCode::out_of_range, letter, Shortest{value}, " is outside of ", Shortest{low},
                      " to ", Shortest{high}, ' ', unit);
}

}  // namespace qduino::printer::gcode
