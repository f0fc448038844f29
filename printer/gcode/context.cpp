#include "printer/gcode/context.h"

#include <algorithm>
#include <cmath>

#include "printer/gcode/dialect.h"

namespace qduino::printer::gcode {

/// M200 L: a move that prints may not push more mm³ a second. As in Marlin a retraction may.
MillimetresPerSecond Context::fastest(const Position& from, const Position& to, MoveKind kind) const {
    const double pushed_mm = (to[Axis::e] - from[Axis::e]).value();
    if (kind == MoveKind::filament) return kFastest;
    if (kind == MoveKind::travel || state.flow_limit_mm3_s == 0 || pushed_mm <= 0) return state.speed_limit;
    const auto along = [&](Axis axis) { return (to[axis] - from[axis]).value(); };
    const double length_mm = std::hypot(along(Axis::x), along(Axis::y), along(Axis::z));
    const MillimetresPerSecond flows{state.flow_limit_mm3_s / state.filament_area_mm2 * length_mm /
                                     pushed_mm};
    return std::clamp(flows, kSlowest, state.speed_limit);
}

Result<void> Context::hand_on(const Position& from, const Position& to, MillimetresPerSecond feedrate,
                              bool firmware_retract) {
    const auto moves = [&](Axis axis) { return from[axis] != to[axis]; };
    const bool tool = std::ranges::any_of(kToolAxes, moves);
    const MoveKind kind = !tool ? MoveKind::filament : moves(Axis::e) ? MoveKind::print : MoveKind::travel;
    const MillimetresPerSecond most = fastest(from, to, kind);
    const MillimetresPerSecond speed = std::clamp(feedrate * state.speed_factor, kSlowest, most);
    return actions.move({from, to, speed, kind, firmware_retract, source, feedrate, most, state.speed_factor,
                         state.flow_factor});
}

Result<void> Context::move_to(const Position& target, MillimetresPerSecond feedrate, bool firmware_retract) {
    if (target == state.machine) return {};
    if (objects.skipping() && !left_at) {
        left_at = state.machine;
        drawn_when_left = state.filament_peak - state.machine[Axis::e];
    }
    if (!left_at) {
        QDUINO_TRY(hand_on(state.machine, target, feedrate, firmware_retract));
        warn_unhomed(target);
    } else if (firmware_retract) {
        Position to = *left_at;
        for (const Axis axis : kAllAxes) to[axis] += target[axis] - state.machine[axis];
        const AxisConfig& z = config.axes[Axis::z];
        to[Axis::z] = std::clamp(to[Axis::z], std::min(z.minimum, (*left_at)[Axis::z]),
                                 std::max(z.maximum, (*left_at)[Axis::z]));
        if (to != *left_at) QDUINO_TRY(hand_on(*left_at, to, feedrate, true));
        drawn_when_left += (*left_at)[Axis::e] - to[Axis::e];
        left_at = to;
    } else if (!objects.skipping()) {
        QDUINO_TRY(follow_in_place(target, feedrate));
    }
    state.machine = target;
    state.filament_peak = std::max(state.filament_peak, target[Axis::e]);
    return {};
}

/// What the program takes to be drawn back may not be what is.
Millimetres Context::owed() const {
    const Millimetres believed = state.filament_peak - state.machine[Axis::e];
    return drawn_when_left - believed;
}

Result<void> Context::bring_filament(Millimetres length, MillimetresPerSecond speed) {
    if (length == Millimetres{0}) return {};
    Position to = *left_at;
    to[Axis::e] += length;
    QDUINO_TRY(hand_on(*left_at, to, speed, false));
    drawn_when_left -= length;
    left_at = to;
    return {};
}

Result<void> Context::rise_to(Millimetres z, MillimetresPerSecond speed) {
    if (z <= (*left_at)[Axis::z]) return {};
    Position up = *left_at;
    up[Axis::z] = z;
    QDUINO_TRY(hand_on(*left_at, up, speed, false));
    left_at = up;
    return {};
}

/// A line behind the object that does not go sideways. An end code may hold no other: what it draws
/// back and how far it goes up is done where the head is. A way down, and filament that is pushed,
/// belong to the program's place: they wait for a line that leads there.
Result<void> Context::follow_in_place(const Position& target, MillimetresPerSecond feedrate) {
    const Millimetres believed = std::max(state.filament_peak, target[Axis::e]) - target[Axis::e];
    QDUINO_TRY(bring_filament(std::min(drawn_when_left - believed, Millimetres{0}), feedrate));
    return rise_to(target[Axis::z], feedrate);
}

Result<void> Context::rejoin(Position& target) {
    if (!left_at || objects.skipping()) return {};
    QDUINO_TRY(bring_filament(std::min(owed(), Millimetres{0}), state.retraction.speed));
    Position at = *left_at;
    const auto go = [&](const Position& to, MillimetresPerSecond feedrate) -> Result<void> {
        if (to == at) return {};
        QDUINO_TRY(hand_on(at, to, feedrate, false));
        at = to;
        left_at = at;
        return {};
    };
    Position over = at;
    over[Axis::z] = std::max(at[Axis::z], target[Axis::z]);
    QDUINO_TRY(go(over, state.feedrate));
    over[Axis::x] = target[Axis::x];
    over[Axis::y] = target[Axis::y];
    QDUINO_TRY(go(over, state.feedrate));
    over[Axis::z] = target[Axis::z];
    QDUINO_TRY(go(over, state.feedrate));
    QDUINO_TRY(bring_filament(owed(), state.retraction.recover_speed));
    const Millimetres pushed = target[Axis::e] - state.machine[Axis::e];
    target[Axis::e] = (*left_at)[Axis::e] + pushed;
    rejoined_at = *left_at;
    stop_waiting();
    return {};
}

Result<void> Context::settle() {
    if (!left_at) return {};
    QDUINO_TRY(bring_filament(std::min(owed(), Millimetres{0}), state.retraction.speed));
    QDUINO_TRY(rise_to(state.machine[Axis::z], state.feedrate));
    return bring_filament(owed(), state.retraction.recover_speed);
}

void Context::stop_waiting() {
    if (!left_at) return;
    state.filament_peak -= state.machine[Axis::e] - (*left_at)[Axis::e];
    state.machine = *left_at;
    left_at.reset();
}

void Context::stop_waiting_there() {
    const auto there = [&](Axis axis) { return state.machine[axis] == (*left_at)[axis]; };
    if (left_at && std::ranges::all_of(kToolAxes, there)) stop_waiting();
}

void Context::stand_at(const Position& machine) {
    const Position before = left_at.value_or(state.machine);
    for (const Axis axis : kAllAxes) state.machine[axis] += machine[axis] - before[axis];
    state.filament_peak += machine[Axis::e] - before[Axis::e];
    if (left_at) left_at = machine;
    if (!left_at) state.machine = machine;
}

void Context::wait_on(const ModalState& before) {
    if (left_at || state.machine != rejoined_at) return;
    left_at = rejoined_at;
    state = before;
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
    QDUINO_TRY(check_room(target));
    const double extruded_mm = (target[Axis::e] - state.machine[Axis::e]).value();
    if (!(std::abs(extruded_mm) <= kLongestExtrusion.value())) {
        return outside('E', extruded_mm, -kLongestExtrusion.value(), kLongestExtrusion.value(),
                       "mm in one move (is a G92 E0 missing?)");
    }
    return {};
}

/// What the box of the axes' bounds does not say: a round bed, and carriages at their switches.
Result<void> Context::check_room(const Position& target) const {
    AxisValues from{}, to{};
    for (const Axis axis : kToolAxes) {
        from[axis] = state.machine[axis].value();
        to[axis] = target[axis].value();
    }
    const double tolerance = kBoundsTolerance.value();
    const bool sideways = from[0] != to[0] || from[1] != to[1];
    if (sideways && !kinematics.is_on_bed(to[0], to[1], tolerance)) {
        return make_error(ErrorCode::out_of_range, "the tool would go to X ", Shortest{to[0]}, ", Y ",
                          Shortest{to[1]}, " mm; this machine reaches ", Shortest{kinematics.bed_radius()},
                          " mm around X 0, Y 0");
    }
    const bool moves = sideways || from[2] != to[2];
    if (!moves || kinematics.carriages_have_room(from, to, tolerance)) return {};
    return make_error(ErrorCode::out_of_range, "the tool would go to X ", Shortest{to[0]}, ", Y ",
                      Shortest{to[1]}, ", Z ", Shortest{to[2]},
                      " mm, and on the way a carriage above its switch: go down before you go sideways");
}

void Context::warn(std::string_view text) {
    ++warnings;
    actions.note(NoteKind::warning, text, source);
}

void Context::count_axes_on(bool relative) {
    state.relative = relative;
    state.axes_came_last = true;
    if (state.dialect == Dialect::marlin) state.relative_e = relative;
}

void Context::note_e() {
    const bool is_marlin = state.dialect == Dialect::marlin;
    const bool here = state.counts_e_on();
    const bool in_marlin = state.axes_came_last ? state.relative : state.said_relative_e;
    const bool in_others = state.said_relative_e || state.relative;
    if (here == in_marlin && here == in_others) return;
    if (is_marlin) e_disputed = source.line;
    // An M82 behind a G91 is meant as it is read.
    if (said_how_e_counts || (is_marlin && !state.said_relative_e)) return;
    said_how_e_counts = true;
    if (is_marlin) return warn("E is absolute here: the G90 before it has ended M83, as Marlin means it");
    auto words = text("E stays relative at G90, as ", name_of(state.dialect), " means it (");
    if (dialect_line == 0) write(words, "machine file)");
    if (dialect_line != 0) write(words, "line ", dialect_line, ')');
    warn(words);
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
                      " to ", Shortest{high}, unit.empty() ? "" : " ", unit);
}

}  // namespace qduino::printer::gcode
