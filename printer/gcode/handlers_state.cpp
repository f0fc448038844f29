// G17 G18 G19 G20 G21 G90 G91 G92 M82 M83 M92 M200 M206 M207 M208 M220 M221 M428: codes that change
// how later commands are read.
#include <cmath>
#include <numbers>

#include "printer/gcode/context.h"

namespace qduino::printer::gcode::handlers {
namespace {

constexpr double kMillimetresPerInch = 25.4;
constexpr double kFactorPercentMin = 1;
constexpr double kFactorPercentMax = 1000;
constexpr double kRetractionMax_mm = 100;
constexpr double kLiftMax_mm = 20;
constexpr double kFilamentMin_mm = 0.5;
constexpr double kFilamentMax_mm = 5;
constexpr double kFlowMax_mm3_s = 1000;
/// M92: E may be calibrated so far from the machine file; X, Y, Z must be the same.
constexpr double kCalibrationShare = 0.25;
constexpr double kSameStepsShare = 1e-4;
/// M428 works so near to the home position: Marlin's limit.
constexpr double kReferenceMm = 20;

}  // namespace

void inches(Context& context, const Command&) { context.state.unit_mm = kMillimetresPerInch; }
void millimetres(Context& context, const Command&) { context.state.unit_mm = 1; }
void absolute(Context& context, const Command&) { context.count_axes_on(false); }
void relative(Context& context, const Command&) { context.count_axes_on(true); }
void absolute_extrusion(Context& context, const Command&) {
    context.state.relative_e = context.state.said_relative_e = context.state.axes_came_last = false;
}
void relative_extrusion(Context& context, const Command&) {
    context.state.relative_e = context.state.said_relative_e = true;
    context.state.axes_came_last = false;
}

Result<void> set_position(Context& context, const Command& command) {
    ModalState& state = context.state;
    const bool all = command.parameters.empty();
    for (const Axis axis : kAllAxes) {
        const char letter = kAxisLetter[axis];
        if (!all && !command.parameters.has(letter)) continue;
        // A letter by itself means 0, and no letter all axes, as in Klipper and in Marlin of before
        // version 2, which passes both over.
        const double value = command.parameters.value(letter).value_or(0);
        if (!(std::abs(value) <= 1e6)) return outside(letter, value, -1e6, 1e6, "");
        const Millimetres programmed{value * (axis == Axis::e ? state.filament_unit() : state.unit_mm)};
        if (axis == Axis::e) {
            state.programmed_e = programmed;
        } else {
            state.offset[axis] = state.machine[axis] - programmed;
        }
    }
    return {};
}

void machine_coordinates(Context& context, const Command&) {
    ModalState& state = context.state;
    for (const Axis axis : kToolAxes) state.offset[axis] = Millimetres{0} - state.home_offset[axis];
    state.offset[Axis::z] += state.lifted;
}

void plane(Context& context, const Command& command) {
    context.state.plane = command.number == 17   ? ArcPlane::xy
                          : command.number == 18 ? ArcPlane::zx
                                                 : ArcPlane::yz;
}

/// M200 D: E is in mm³ of filament of this diameter; D0: in mm again. S switches alone. L: no move
/// that prints pushes more mm³ a second, however E is counted; L0: no limit.
Result<void> volumetric(Context& context, const Command& command) {
    ModalState& state = context.state;
    QDUINO_TRY_ASSIGN(const auto tool, number(command, 'T'));
    QDUINO_TRY_ASSIGN(const auto diameter, number(command, 'D'));
    QDUINO_TRY_ASSIGN(const auto on, number(command, 'S'));
    if (tool.value_or(0) != 0) return {};  // of a tool that is not there
    QDUINO_TRY_ASSIGN(const auto limit, number_within(command, 'L', 0, kFlowMax_mm3_s, "mm³/s"));
    const double diameter_mm = diameter.value_or(0) * state.unit_mm;
    if (diameter_mm != 0 && !(diameter_mm >= kFilamentMin_mm && diameter_mm <= kFilamentMax_mm))
        return outside('D', diameter_mm, kFilamentMin_mm, kFilamentMax_mm, "mm of diameter");
    if (diameter) state.volumetric = diameter_mm > 0;
    if (diameter_mm > 0) state.filament_area_mm2 = std::numbers::pi / 4 * diameter_mm * diameter_mm;
    if (on) state.volumetric = *on != 0;
    if (limit) state.flow_limit_mm3_s = *limit;
    return {};
}

/// M92: for E the calibration of a filament drive, applied as a factor. X, Y and Z are the machine
/// file's: another number would make parts of another size.
Result<void> steps_per_mm(Context& context, const Command& command) {
    QDUINO_TRY_ASSIGN(const auto tool, number(command, 'T'));
    if (tool.value_or(0) != 0) return {};
    for (const Axis axis : kAllAxes) {
        QDUINO_TRY_ASSIGN(const auto given, number(command, kAxisLetter[axis]));
        if (!given) continue;
        const double machine = context.config.axes[axis].steps_per_mm;
        const double ratio = *given / machine;
        const double tolerance = axis == Axis::e ? kCalibrationShare : kSameStepsShare;
        if (!(std::abs(ratio - 1) <= tolerance)) {
            return make_error(ErrorCode::out_of_range, kAxisLetter[axis], Shortest{*given},
                              " steps/mm are not this machine's ", Shortest{machine},
                              " (steps_per_mm in its machine file)");
        }
        if (axis == Axis::e) context.state.filament_scale = ratio;
    }
    return {};
}

void set_home_offset(ModalState& state, Axis axis, Millimetres offset) {
    state.offset[axis] += state.home_offset[axis] - offset;
    state.home_offset[axis] = offset;
}

/// M206: so much is added to what the home position is called.
Result<void> home_offsets(Context& context, const Command& command) {
    ModalState& state = context.state;
    for (const Axis axis : kToolAxes) {
        QDUINO_TRY_ASSIGN(const auto given, number_within(command, kAxisLetter[axis], -1e3, 1e3, ""));
        if (given) set_home_offset(state, axis, Millimetres{*given * state.unit_mm});
    }
    return {};
}

/// M428: the present place is to be called as the home position is. Only near it.
Result<void> home_offsets_here(Context& context, const Command&) {
    ModalState& state = context.state;
    Position off;
    for (const Axis axis : kToolAxes) {
        off[axis] = context.config.axes[axis].home_position - state.machine[axis];
        if (std::abs(off[axis].value()) > kReferenceMm)
            return make_error(ErrorCode::out_of_range, kAxisLetter[axis], " is more than ",
                              Shortest{kReferenceMm}, " mm from its home position");
    }
    for (const Axis axis : kToolAxes) set_home_offset(state, axis, off[axis]);
    return {};
}

Result<void> retraction_settings(Context& context, const Command& command) {
    ModalState& state = context.state;
    RetractionSettings& settings = state.retraction;
    const double unit = state.unit_mm;
    QDUINO_TRY(take_scaled(command, 'S', unit, 0, kRetractionMax_mm, settings.length, "mm"));
    QDUINO_TRY(take_scaled(command, 'Z', unit, 0, kLiftMax_mm, settings.lift, "mm"));
    return take_scaled(command, 'F', unit / 60, kSlowest.value(), kFastest.value(), settings.speed, "mm/s");
}

Result<void> recover_settings(Context& context, const Command& command) {
    ModalState& state = context.state;
    RetractionSettings& settings = state.retraction;
    const double unit = state.unit_mm;
    QDUINO_TRY(take_scaled(command, 'S', unit, -kRetractionMax_mm, kRetractionMax_mm,
                           settings.extra_on_recover, "mm"));
    return take_scaled(command, 'F', unit / 60, kSlowest.value(), kFastest.value(), settings.recover_speed,
                       "mm/s");
}

Result<void> speed_factor(Context& context, const Command& command) {
    QDUINO_TRY_ASSIGN(const auto percent,
                      number_within(command, 'S', kFactorPercentMin, kFactorPercentMax, "percent"));
    ModalState& state = context.state;
    if (command.parameters.has('B')) state.speed_factor_kept = state.speed_factor;
    if (command.parameters.has('R')) state.speed_factor = state.speed_factor_kept;
    if (percent) state.speed_factor = *percent / 100;
    context.actions.factors(state.speed_factor, state.flow_factor);
    return {};
}

Result<void> flow_factor(Context& context, const Command& command) {
    QDUINO_TRY_ASSIGN(const auto percent,
                      number_within(command, 'S', kFactorPercentMin, kFactorPercentMax, "percent"));
    QDUINO_TRY_ASSIGN(const auto tool, number(command, 'T'));
    QDUINO_TRY_ASSIGN(const auto drive, number(command, 'D'));  // RepRapFirmware's
    ModalState& state = context.state;
    if (percent && tool.value_or(0) == 0 && drive.value_or(0) == 0) state.flow_factor = *percent / 100;
    context.actions.factors(state.speed_factor, state.flow_factor);
    return {};
}

void nothing(Context&, const Command&) {}

}  // namespace qduino::printer::gcode::handlers
