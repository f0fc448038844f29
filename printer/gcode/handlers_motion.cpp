// G0 G1 G2 G3 G4 G10 G11 G28 M400 T: codes that move the machine, or wait for it.
#include <algorithm>

#include "printer/gcode/context.h"

namespace qduino::printer::gcode::handlers {
namespace {

constexpr double kSecondsPerMinute = 60;

/// The place to which X, Y, Z and E of a command lead.
struct Target {
    Position machine;
    Millimetres programmed_e;
};

Result<Target> target_of(const ModalState& state, const Command& command) {
    Target target{state.machine, state.programmed_e};
    for (const Axis axis : kAllAxes) {
        QDUINO_TRY_ASSIGN(const auto value, number(command, kAxisLetter[axis]));
        if (!value) continue;
        const Millimetres length{*value * state.unit_mm};
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
    QDUINO_TRY_ASSIGN(const auto value, number(command, 'F'));
    if (!value || *value == 0) return {};
    if (*value < 0) return make_error(ErrorCode::invalid_argument, "F, a speed, is below 0");
    const MillimetresPerSecond asked{*value * state.unit_mm / kSecondsPerMinute};
    state.feedrate = std::clamp(asked, kSlowest, kFastest);
    return {};
}

Result<ArcGeometry> geometry_of(const ModalState& state, const Command& command, ArcDirection direction) {
    QDUINO_TRY_ASSIGN(const auto i, number(command, 'I'));
    QDUINO_TRY_ASSIGN(const auto j, number(command, 'J'));
    QDUINO_TRY_ASSIGN(const auto r, number(command, 'R'));
    QDUINO_TRY_ASSIGN(const auto p, number_within(command, 'P', 0, kArcTurnsMax, "turns"));
    if (!r && !i && !j) return make_error(ErrorCode::invalid_argument, "an arc needs a centre: I, J or R");
    if (r && (i || j)) return make_error(ErrorCode::invalid_argument, "an arc takes I and J, or R, not both");
    const double unit = state.unit_mm;
    return ArcGeometry{.direction = direction,
                       .by_radius = r.has_value(),
                       .centre_dx_mm = i.value_or(0) * unit,
                       .centre_dy_mm = j.value_or(0) * unit,
                       .radius_mm = r.value_or(0) * unit,
                       .turns = static_cast<std::uint32_t>(p.value_or(0))};
}

/// All of the arc must lie inside the bounds before its first chord is handed on.
Result<void> check_chords(const Context& context, const ArcPath& arc) {
    for (std::uint32_t i = 0; i < arc.chords(); ++i) {
        Position point = arc.point(i);
        QDUINO_TRY(context.check_target(point));
    }
    return {};
}

Result<void> arc(Context& context, const Command& command, ArcDirection direction) {
    ModalState& state = context.state;
    QDUINO_TRY_ASSIGN(auto target, target_of(state, command));
    QDUINO_TRY(take_feedrate(state, command));
    QDUINO_TRY_ASSIGN(const auto geometry, geometry_of(state, command, direction));
    QDUINO_TRY(context.check_target(target.machine));
    QDUINO_TRY_ASSIGN(const auto arc, ArcPath::make(state.machine, target.machine, geometry));
    QDUINO_TRY(check_chords(context, arc));
    state.programmed_e = target.programmed_e;
    context.arc = arc;
    return {};
}

}  // namespace

Result<void> linear_move(Context& context, const Command& command) {
    ModalState& state = context.state;
    QDUINO_TRY_ASSIGN(auto target, target_of(state, command));
    QDUINO_TRY(take_feedrate(state, command));
    QDUINO_TRY(context.check_target(target.machine));
    state.programmed_e = target.programmed_e;
    return context.move_to(target.machine, state.feedrate);
}

Result<void> arc_clockwise(Context& i, const Command& c) { return arc(i, c, ArcDirection::clockwise); }

Result<void> arc_counterclockwise(Context& context, const Command& command) {
    return arc(context, command, ArcDirection::counterclockwise);
}

Result<void> dwell(Context& context, const Command& command) {
    QDUINO_TRY_ASSIGN(const auto seconds, number_within(command, 'S', 0, kLongestDwell.value(), "s"));
    QDUINO_TRY_ASSIGN(const auto milliseconds,
                      number_within(command, 'P', 0, kLongestDwell.value() * 1000, "ms"));
    return context.actions.dwell(Seconds{seconds.value_or(milliseconds.value_or(0) / 1000)});
}

Result<void> wait_for_moves(Context& context, const Command&) { return context.actions.dwell(Seconds{0}); }

Result<void> retract(Context& context, const Command&) {
    ModalState& state = context.state;
    if (state.retracted) return {};
    const RetractionSettings settings = state.retraction;
    Position drawn = state.machine;
    drawn[Axis::e] -= settings.length;
    Position lifted = drawn;
    lifted[Axis::z] += settings.lift;
    QDUINO_TRY(context.check_target(lifted));
    QDUINO_TRY(context.move_to(drawn, settings.speed, true));
    state.retracted = true;
    state.retracted_length = settings.length;
    const Millimetres lift = lifted[Axis::z] - state.machine[Axis::z];
    const MillimetresPerSecond lift_speed = context.config.axes[Axis::z].max_speed;
    QDUINO_TRY(context.move_to(lifted, lift_speed, true));
    state.lifted = lift;
    state.offset[Axis::z] += lift;
    return {};
}

Result<void> recover(Context& context, const Command&) {
    ModalState& state = context.state;
    if (!state.retracted) return {};
    Position lowered = state.machine;
    lowered[Axis::z] -= state.lifted;
    Position pushed = lowered;
    pushed[Axis::e] += state.retracted_length + state.retraction.extra_on_recover;
    QDUINO_TRY(context.check_target(pushed));
    lowered[Axis::z] = pushed[Axis::z];
    const MillimetresPerSecond lift_speed = context.config.axes[Axis::z].max_speed;
    QDUINO_TRY(context.move_to(lowered, lift_speed, true));
    state.offset[Axis::z] -= state.lifted;
    state.lifted = Millimetres{0};
    QDUINO_TRY(context.move_to(pushed, state.retraction.recover_speed, true));
    state.retracted = false;
    return {};
}

Result<void> home(Context& context, const Command& command) {
    const AxisSet axes = axes_of(command, AxisSet::tool());
    QDUINO_TRY(context.actions.home(axes));
    ModalState& state = context.state;
    for (const Axis axis : kToolAxes) {
        if (!axes.contains(axis)) continue;
        state.machine[axis] = context.config.axes[axis].home_position;
        state.offset[axis] = Millimetres{0};
        state.set_homed(axis, true);
        if (axis == Axis::z) state.lifted = Millimetres{0};
    }
    return {};
}

Result<void> tool(Context&, const Command& command) {
    if (command.number == 0) return {};
    return make_error(ErrorCode::unsupported, "this machine has one tool, T0");
}

}  // namespace qduino::printer::gcode::handlers
