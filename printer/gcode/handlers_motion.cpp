// G0 G1 G2 G3 G4 G10 G11 G28 M400 T: what moves the machine, or waits for it.
#include <algorithm>
#include <cmath>

#include "printer/gcode/handlers.h"

namespace qduino::printer::gcode {
namespace {

constexpr double kSecondsPerMinute = 60;

/// Where X, Y, Z and E of a command lead.
struct Target {
    Position machine;
    Millimetres programmed_e;
};

Result<Target> target_of(const ModalState& state, const Command& command) {
    Target target{state.machine, state.programmed_e};
    for (const Axis axis : kAllAxes) {
        const auto value = Handlers::number(command, kAxisLetter[static_cast<std::size_t>(axis)]);
        if (!value) return value.error();
        if (!*value) continue;
        const Millimetres length{**value * state.unit_mm};
        if (axis == Axis::e) {
            target.programmed_e = state.relative_e ? state.programmed_e + length : length;
            target.machine[axis] += (target.programmed_e - state.programmed_e) * state.flow_factor;
        } else {
            target.machine[axis] = length + (state.relative ? state.machine[axis] : state.offset[axis]);
        }
    }
    return target;
}

/// F is modal and per minute; F0 says nothing, as in Marlin.
Result<void> take_feedrate(ModalState& state, const Command& command) {
    const auto value = Handlers::number(command, 'F');
    if (!value) return value.error();
    if (!*value || **value == 0) return {};
    if (**value < 0) return make_error(ErrorCode::invalid_argument, "F, a speed, is below 0");
    const MillimetresPerSecond asked{**value * state.unit_mm / kSecondsPerMinute};
    state.feedrate = std::clamp(asked, kSlowest, kFastest);
    return {};
}

Result<ArcGeometry> geometry_of(const ModalState& state, const Command& command, ArcDirection direction) {
    ArcGeometry geometry;
    geometry.direction = direction;
    const auto i = Handlers::number(command, 'I');
    const auto j = Handlers::number(command, 'J');
    const auto r = Handlers::number(command, 'R');
    const auto p = Handlers::number_within(command, 'P', 0, kArcTurnsMax, "turns");
    for (const auto* value : {&i, &j, &r, &p}) {
        if (!*value) return value->error();
    }
    if (!*r && !*i && !*j) return make_error(ErrorCode::invalid_argument, "an arc needs a centre: I, J or R");
    if (*r && (*i || *j))
        return make_error(ErrorCode::invalid_argument, "an arc takes I and J, or R, not both");
    geometry.by_radius = r->has_value();
    geometry.radius_mm = r->value_or(0) * state.unit_mm;
    geometry.centre_dx_mm = i->value_or(0) * state.unit_mm;
    geometry.centre_dy_mm = j->value_or(0) * state.unit_mm;
    geometry.turns = static_cast<std::uint32_t>(p->value_or(0));
    return geometry;
}

}  // namespace

Result<void> Handlers::linear_move(Interpreter& interpreter, const Command& command) {
    ModalState& state = interpreter.state_;
    auto target = target_of(state, command);
    if (!target) return target.error();
    if (auto feedrate = take_feedrate(state, command); !feedrate) return feedrate;
    if (auto checked = interpreter.check_target(target->machine); !checked) return checked;
    state.programmed_e = target->programmed_e;
    return interpreter.emit(target->machine, state.feedrate);
}

namespace {

/// All of the arc must lie inside the bounds before its first chord is handed on.
template <typename CheckTarget>
Result<void> check_chords(const ArcPath& arc, CheckTarget check_target) {
    for (std::uint32_t i = 0; i < arc.chords(); ++i) {
        Position point = arc.point(i);
        if (auto inside = check_target(point); !inside) return inside;
    }
    return {};
}

}  // namespace

Result<void> Handlers::arc(Interpreter& interpreter, const Command& command, ArcDirection direction) {
    ModalState& state = interpreter.state_;
    auto target = target_of(state, command);
    if (!target) return target.error();
    if (auto feedrate = take_feedrate(state, command); !feedrate) return feedrate;
    const auto geometry = geometry_of(state, command, direction);
    if (!geometry) return geometry.error();
    if (auto checked = interpreter.check_target(target->machine); !checked) return checked;
    const auto arc = ArcPath::make(state.machine, target->machine, *geometry);
    if (!arc) return arc.error();
    const auto check = [&](Position& point) { return interpreter.check_target(point); };
    if (auto inside = check_chords(*arc, check); !inside) return inside;
    state.programmed_e = target->programmed_e;
    interpreter.arc_ = *arc;
    return {};
}

Result<void> Handlers::arc_clockwise(Interpreter& interpreter, const Command& command) {
    return arc(interpreter, command, ArcDirection::clockwise);
}

Result<void> Handlers::arc_counterclockwise(Interpreter& interpreter, const Command& command) {
    return arc(interpreter, command, ArcDirection::counterclockwise);
}

Result<void> Handlers::dwell(Interpreter& interpreter, const Command& command) {
    const auto seconds = number_within(command, 'S', 0, kLongestDwell.value(), "s");
    const auto milliseconds = number_within(command, 'P', 0, kLongestDwell.value() * 1000, "ms");
    if (!seconds) return seconds.error();
    if (!milliseconds) return milliseconds.error();
    const double duration_s = *seconds ? **seconds : milliseconds->value_or(0) / 1000;
    return interpreter.actions_.dwell(Seconds{duration_s});
}

Result<void> Handlers::wait_for_moves(Interpreter& interpreter, const Command&) {
    return interpreter.actions_.dwell(Seconds{0});
}

Result<void> Handlers::retract(Interpreter& interpreter, const Command&) {
    ModalState& state = interpreter.state_;
    if (state.retracted) return {};
    const RetractionSettings settings = state.retraction;
    Position drawn = state.machine;
    drawn[Axis::e] -= settings.length;
    Position lifted = drawn;
    lifted[Axis::z] += settings.lift;
    if (auto checked = interpreter.check_target(lifted); !checked) return checked;
    if (auto moved = interpreter.emit(drawn, settings.speed, true); !moved) return moved;
    state.retracted = true;
    state.retracted_length = settings.length;
    const Millimetres lift = lifted[Axis::z] - state.machine[Axis::z];
    const MillimetresPerSecond lift_speed{
        interpreter.config_.axes[static_cast<std::size_t>(Axis::z)].max_speed_mm_s};
    if (auto moved = interpreter.emit(lifted, lift_speed, true); !moved) return moved;
    state.lifted = lift;
    state.offset[Axis::z] += lift;
    return {};
}

Result<void> Handlers::recover(Interpreter& interpreter, const Command&) {
    ModalState& state = interpreter.state_;
    if (!state.retracted) return {};
    Position lowered = state.machine;
    lowered[Axis::z] -= state.lifted;
    Position pushed = lowered;
    pushed[Axis::e] += state.retracted_length + state.retraction.extra_on_recover;
    if (auto checked = interpreter.check_target(pushed); !checked) return checked;
    lowered[Axis::z] = pushed[Axis::z];
    const MillimetresPerSecond lift_speed{
        interpreter.config_.axes[static_cast<std::size_t>(Axis::z)].max_speed_mm_s};
    if (auto moved = interpreter.emit(lowered, lift_speed, true); !moved) return moved;
    state.offset[Axis::z] -= state.lifted;
    state.lifted = Millimetres{0};
    if (auto moved = interpreter.emit(pushed, state.retraction.recover_speed, true); !moved) return moved;
    state.retracted = false;
    return {};
}

Result<void> Handlers::home(Interpreter& interpreter, const Command& command) {
    AxisSet axes;
    for (const Axis axis : kToolAxes) {
        if (command.parameters.has(kAxisLetter[static_cast<std::size_t>(axis)])) axes.add(axis);
    }
    if (axes.empty()) axes = AxisSet::tool();
    if (auto homed = interpreter.actions_.home(axes); !homed) return homed;
    ModalState& state = interpreter.state_;
    for (const Axis axis : kToolAxes) {
        if (!axes.contains(axis)) continue;
        const auto index = static_cast<std::size_t>(axis);
        state.machine[axis] = Millimetres{interpreter.config_.axes[index].home_position_mm};
        state.offset[axis] = Millimetres{0};
        state.homed[index] = true;
        state.warned_unhomed[index] = false;
        if (axis == Axis::z) state.lifted = Millimetres{0};
    }
    return {};
}

Result<void> Handlers::tool(Interpreter&, const Command& command) {
    if (command.number == 0) return {};
    return make_error(ErrorCode::unsupported, "this machine has one tool, T0");
}

}  // namespace qduino::printer::gcode
