// F G0 G1 G2 G3 G4 G5 G10 G11 G28 M400 S T: codes that move the machine, or wait for it.
#include <algorithm>
#include <string_view>

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
        const Millimetres length{*value * (axis == Axis::e ? state.filament_unit() : state.unit_mm)};
        if (axis == Axis::e) {
            target.programmed_e = state.counts_e_on() ? state.programmed_e + length : length;
            target.machine[axis] += (target.programmed_e - state.programmed_e) * state.filament_factor();
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
    // The third has no place in the plane.
    constexpr const char* kCentreLetters[]{"IJK", "KIJ", "JKI"};
    const char* const letters = kCentreLetters[static_cast<std::size_t>(state.plane)];
    QDUINO_TRY_ASSIGN(const auto first, number(command, letters[0]));
    QDUINO_TRY_ASSIGN(const auto second, number(command, letters[1]));
    QDUINO_TRY_ASSIGN(const auto third, number(command, letters[2]));
    QDUINO_TRY_ASSIGN(const auto r, number(command, 'R'));
    QDUINO_TRY_ASSIGN(const auto p, number_within(command, 'P', 0, kArcTurnsMax, "turns"));
    if (third.value_or(0) != 0)
        return make_error(ErrorCode::invalid_argument, letters[2], " is no centre in this plane");
    if (!r && !first && !second) {
        return make_error(ErrorCode::invalid_argument, "an arc needs a centre: ", letters[0], ", ",
                          letters[1], " or R");
    }
    if (r && (first || second)) {
        return make_error(ErrorCode::invalid_argument, "an arc takes ", letters[0], " and ", letters[1],
                          ", or R, not both");
    }
    const double unit = state.unit_mm;
    return ArcGeometry{.direction = direction,
                       .plane = state.plane,
                       .by_radius = r.has_value(),
                       .centre_first_mm = first.value_or(0) * unit,
                       .centre_second_mm = second.value_or(0) * unit,
                       .radius_mm = r.value_or(0) * unit,
                       .turns = static_cast<std::uint32_t>(p.value_or(0))};
}

/// All of the curve must lie inside the bounds before its first chord is handed on.
Result<void> check_chords(const Context& context, const Curve& curve) {
    for (std::uint32_t i = 0; i < curve.chords(); ++i) {
        Position point = curve.point(i);
        QDUINO_TRY(context.check_target(point));
    }
    return {};
}

/// A curve, and where E is behind it.
struct Asked {
    Curve curve;
    Millimetres programmed_e;
};

/// Makes the curve that `ask` returns the one in hand. A head that waits comes first to where the
/// program is; what it left out of the filament changes where the curve begins and ends.
template <typename Ask>
Result<void> begin(Context& context, const Command& command, Ask&& ask) {
    QDUINO_TRY_ASSIGN(Asked asked, ask());
    QDUINO_TRY(check_chords(context, asked.curve));
    if (command.parameters.has('E')) context.note_e();
    if (context.left_at && !context.objects.skipping()) {
        Position here = context.state.machine;
        QDUINO_TRY(context.rejoin(here));
        QDUINO_TRY_ASSIGN(asked, ask());
    }
    context.state.programmed_e = asked.programmed_e;
    context.curve = asked.curve;
    return {};
}

Result<void> arc(Context& context, const Command& command, ArcDirection direction) {
    ModalState& state = context.state;
    QDUINO_TRY(take_feedrate(state, command));
    QDUINO_TRY_ASSIGN(const auto geometry, geometry_of(state, command, direction));
    return begin(context, command, [&]() -> Result<Asked> {
        QDUINO_TRY_ASSIGN(auto target, target_of(state, command));
        QDUINO_TRY(context.check_target(target.machine));
        QDUINO_TRY_ASSIGN(const auto path, ArcPath::make(state.machine, target.machine, geometry));
        return Asked{Curve{path}, target.programmed_e};
    });
}

/// S and H of RepRapFirmware's G1 make a move that ends at a switch, or one motor by itself.
Result<void> check_plain_move(const Command& command) {
    for (const char letter : {'S', 'H'}) {
        QDUINO_TRY_ASSIGN(const auto kind, number(command, letter));
        if (kind.value_or(0) == 0) continue;
        return make_error(ErrorCode::unsupported, letter, Shortest{*kind},
                          " asks for a move that ends at a switch: only G28 does that here");
    }
    return {};
}

/// RepRapFirmware's G10 P: S is the tool's temperature, R the one while it waits, X Y Z its place.
Result<void> tool_settings(Context& context, const Command& command) {
    for (const char letter : {'X', 'Y', 'Z'}) {
        QDUINO_TRY_ASSIGN(const auto offset, number(command, letter));
        if (offset.value_or(0) == 0) continue;
        return make_error(ErrorCode::unsupported, "this machine has one tool, which stands at no offset");
    }
    return set_tool_temperature(context, command, 'P');
}

}  // namespace

Result<void> linear_move(Context& context, const Command& command) {
    ModalState& state = context.state;
    QDUINO_TRY(check_plain_move(command));
    QDUINO_TRY_ASSIGN(auto target, target_of(state, command));
    QDUINO_TRY(take_feedrate(state, command));
    QDUINO_TRY(context.check_target(target.machine));
    if (command.parameters.has('E')) context.note_e();
    if (context.goes_sideways(target.machine)) QDUINO_TRY(context.rejoin(target.machine));
    const Result<void> moved = context.move_to(target.machine, state.feedrate);
    if (moved) state.programmed_e = target.programmed_e;
    return moved;
}

/// RS274's modal words: F counts from here on. S is the speed of a spindle, and nothing until an
/// M3.
Result<void> lone_speed(Context& context, const Command& command) {
    QDUINO_TRY(take_feedrate(context.state, command));
    if (command.parameters.has('S'))
        context.warn("S alone is the speed of a spindle: it changes nothing here");
    return {};
}

Result<void> arc_clockwise(Context& i, const Command& c) { return arc(i, c, ArcDirection::clockwise); }

Result<void> arc_counterclockwise(Context& context, const Command& command) {
    return arc(context, command, ArcDirection::counterclockwise);
}

Result<void> spline(Context& context, const Command& command) {
    ModalState& state = context.state;
    if (state.plane != ArcPlane::xy)
        return make_error(ErrorCode::unsupported, "a spline lies in the XY plane (G17)");
    QDUINO_TRY(take_feedrate(state, command));
    double controls[4] = {};
    for (std::size_t i = 0; i < 4; ++i) {
        QDUINO_TRY_ASSIGN(const auto given, number(command, "IJPQ"[i]));
        if (!given) return make_error(ErrorCode::invalid_argument, "a spline needs I, J, P and Q");
        controls[i] = *given * state.unit_mm;
    }
    const SplineGeometry geometry{controls[0], controls[1], controls[2], controls[3]};
    return begin(context, command, [&]() -> Result<Asked> {
        QDUINO_TRY_ASSIGN(auto target, target_of(state, command));
        QDUINO_TRY(context.check_target(target.machine));
        QDUINO_TRY_ASSIGN(const auto path, SplinePath::make(state.machine, target.machine, geometry));
        return Asked{Curve{path}, target.programmed_e};
    });
}

Result<void> dwell(Context& context, const Command& command) {
    QDUINO_TRY_ASSIGN(const auto seconds, number_within(command, 'S', 0, kLongestDwell.value(), "s"));
    QDUINO_TRY_ASSIGN(const auto milliseconds,
                      number_within(command, 'P', 0, kLongestDwell.value() * 1000, "ms"));
    return context.actions.dwell(Seconds{seconds.value_or(milliseconds.value_or(0) / 1000)});
}

Result<void> wait_for_moves(Context& context, const Command&) { return context.actions.dwell(Seconds{0}); }

Result<void> retract(Context& context, const Command& command) {
    if (command.parameters.has('P')) return tool_settings(context, command);
    ModalState& state = context.state;
    if (state.retracted) return {};
    const RetractionSettings settings = state.retraction;
    Position drawn = state.machine;
    drawn[Axis::e] -= settings.length * state.filament_scale;
    Position lifted = drawn;
    lifted[Axis::z] += settings.lift;
    QDUINO_TRY(context.check_target(lifted));
    QDUINO_TRY(context.move_to(drawn, settings.speed, true));
    state.retracted = true;
    state.retracted_length = settings.length * state.filament_scale;
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
    pushed[Axis::e] += state.retracted_length + state.retraction.extra_on_recover * state.filament_scale;
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

/// Letters of axes that other machines have. (W is Prusa's: home without probing the mesh.)
constexpr std::string_view kForeignAxes = "ABCUV";

Result<void> home(Context& context, const Command& command) {
    const auto has = [&](char letter) { return command.parameters.has(letter); };
    const bool named = has('X') || has('Y') || has('Z');
    // O: only if need be. What an earlier job has homed does not count: a job brings its own.
    const auto is_known = [&](Axis axis) { return context.state.homed_by_job[axis]; };
    if (has('O') && std::ranges::all_of(kToolAxes, is_known)) return {};
    if (!named && std::ranges::any_of(kForeignAxes, has)) {
        context.warn("the axes of this G28 are not there: nothing to home");
        return {};
    }
    AxisSet axes;
    // One tower's switch alone says nothing of a delta's tool.
    const bool all = !named || context.kinematics.homes_together();
    for (const Axis axis : kToolAxes)
        if (all || has(kAxisLetter[axis])) axes.add(axis);
    QDUINO_TRY(context.settle());
    QDUINO_TRY(context.actions.home(axes));
    ModalState& state = context.state;
    for (const Axis axis : kToolAxes) {
        if (!axes.contains(axis)) continue;
        state.machine[axis] = context.config.axes[axis].home_position;
        if (context.left_at) (*context.left_at)[axis] = state.machine[axis];
        state.offset[axis] = state.code_offset[axis] - state.home_offset[axis];
        state.set_homed(axis, true);
        state.homed_by_job[axis] = true;
        if (axis == Axis::z) state.lifted = Millimetres{0};
    }
    context.stop_waiting_there();
    return {};
}

Result<void> tool(Context&, const Command& command) {
    if (command.number == 0) return {};
    return make_error(ErrorCode::unsupported, "this machine has one tool, T0");
}

/// M6 T0: a word of machine tools, and of MakerBots, for the tool that follows.
Result<void> tool_change(Context&, const Command& command) {
    QDUINO_TRY_ASSIGN(const auto tool, number(command, 'T'));
    if (tool.value_or(0) == 0) return {};
    return make_error(ErrorCode::unsupported, "this machine has one tool, T0");
}

}  // namespace qduino::printer::gcode::handlers
