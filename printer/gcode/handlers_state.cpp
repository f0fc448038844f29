// G20 G21 G90 G91 G92 M82 M83 M207 M208 M220 M221: codes that change how later commands are read.
#include "printer/gcode/context.h"

namespace qduino::printer::gcode::handlers {
namespace {

constexpr double kMillimetresPerInch = 25.4;
constexpr double kFactorPercentMin = 1;
constexpr double kFactorPercentMax = 1000;
constexpr double kRetractionMax_mm = 100;
constexpr double kLiftMax_mm = 20;

}  // namespace

void inches(Context& context, const Command&) { context.state.unit_mm = kMillimetresPerInch; }
void millimetres(Context& context, const Command&) { context.state.unit_mm = 1; }
void absolute(Context& context, const Command&) { context.state.relative = context.state.relative_e = false; }
void relative(Context& context, const Command&) { context.state.relative = context.state.relative_e = true; }
void absolute_extrusion(Context& context, const Command&) { context.state.relative_e = false; }
void relative_extrusion(Context& context, const Command&) { context.state.relative_e = true; }

Result<void> set_position(Context& context, const Command& command) {
    ModalState& state = context.state;
    const bool all = command.parameters.empty();
    for (const Axis axis : kAllAxes) {
        const char letter = kAxisLetter[axis];
        QDUINO_TRY_ASSIGN(const auto value, number_within(command, letter, -1e6, 1e6, ""));
        if (!value && !all) continue;
        const Millimetres programmed{value.value_or(0) * state.unit_mm};
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
    for (const Axis axis : kToolAxes) state.offset[axis] = Millimetres{0};
    state.offset[Axis::z] = state.lifted;
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
    ModalState& state = context.state;
    if (percent) state.flow_factor = *percent / 100;
    context.actions.factors(state.speed_factor, state.flow_factor);
    return {};
}

void nothing(Context&, const Command&) {}

}  // namespace qduino::printer::gcode::handlers
