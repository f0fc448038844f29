// G20 G21 G90 G91 G92 M82 M83 M207 M208 M220 M221: what changes how later commands are understood.
#include "printer/gcode/handlers.h"

namespace qduino::printer::gcode {
namespace {

constexpr double kMillimetresPerInch = 25.4;
constexpr double kFactorPercentMin = 1;
constexpr double kFactorPercentMax = 1000;
constexpr double kRetractionMax_mm = 100;
constexpr double kLiftMax_mm = 20;

/// Puts the number behind `letter`, in the unit in force, into `value` if it is given.
template <typename Quantity>
Result<void> take_length(const Command& command, char letter, double scale, double low, double high,
                         Quantity& value, std::string_view unit) {
    const auto given = Handlers::number(command, letter);
    if (!given) return given.error();
    if (!*given) return {};
    const double scaled = **given * scale;
    if (!(scaled >= low && scaled <= high)) return Handlers::outside(letter, scaled, low, high, unit);
    value = Quantity{scaled};
    return {};
}

}  // namespace

Result<void> Handlers::inches(Interpreter& interpreter, const Command&) {
    interpreter.state_.unit_mm = kMillimetresPerInch;
    return {};
}

Result<void> Handlers::millimetres(Interpreter& interpreter, const Command&) {
    interpreter.state_.unit_mm = 1;
    return {};
}

Result<void> Handlers::absolute(Interpreter& interpreter, const Command&) {
    interpreter.state_.relative = interpreter.state_.relative_e = false;
    return {};
}

Result<void> Handlers::relative(Interpreter& interpreter, const Command&) {
    interpreter.state_.relative = interpreter.state_.relative_e = true;
    return {};
}

Result<void> Handlers::absolute_extrusion(Interpreter& interpreter, const Command&) {
    interpreter.state_.relative_e = false;
    return {};
}

Result<void> Handlers::relative_extrusion(Interpreter& interpreter, const Command&) {
    interpreter.state_.relative_e = true;
    return {};
}

Result<void> Handlers::set_position(Interpreter& interpreter, const Command& command) {
    ModalState& state = interpreter.state_;
    const bool all = command.parameters.empty();
    for (const Axis axis : kAllAxes) {
        const char letter = kAxisLetter[static_cast<std::size_t>(axis)];
        const auto value = number_within(command, letter, -1e6, 1e6, "");
        if (!value) return value.error();
        if (!*value && !all) continue;
        const Millimetres programmed{value->value_or(0) * state.unit_mm};
        if (axis == Axis::e) {
            state.programmed_e = programmed;
        } else {
            state.offset[axis] = state.machine[axis] - programmed;
        }
    }
    return {};
}

Result<void> Handlers::machine_coordinates(Interpreter& interpreter, const Command&) {
    ModalState& state = interpreter.state_;
    for (const Axis axis : kToolAxes) state.offset[axis] = Millimetres{0};
    state.offset[Axis::z] = state.lifted;
    return {};
}

Result<void> Handlers::retraction_settings(Interpreter& interpreter, const Command& command) {
    ModalState& state = interpreter.state_;
    RetractionSettings& settings = state.retraction;
    const double unit = state.unit_mm;
    if (auto r = take_length(command, 'S', unit, 0, kRetractionMax_mm, settings.length, "mm"); !r) return r;
    if (auto r = take_length(command, 'Z', unit, 0, kLiftMax_mm, settings.lift, "mm"); !r) return r;
    return take_length(command, 'F', unit / 60, kSlowest.value(), kFastest.value(), settings.speed, "mm/s");
}

Result<void> Handlers::recover_settings(Interpreter& interpreter, const Command& command) {
    ModalState& state = interpreter.state_;
    RetractionSettings& settings = state.retraction;
    const double unit = state.unit_mm;
    if (auto r = take_length(command, 'S', unit, -kRetractionMax_mm, kRetractionMax_mm,
                             settings.extra_on_recover, "mm");
        !r) {
        return r;
    }
    return take_length(command, 'F', unit / 60, kSlowest.value(), kFastest.value(), settings.recover_speed,
                       "mm/s");
}

Result<void> Handlers::speed_factor(Interpreter& interpreter, const Command& command) {
    const auto percent = number_within(command, 'S', kFactorPercentMin, kFactorPercentMax, "percent");
    if (!percent) return percent.error();
    ModalState& state = interpreter.state_;
    if (command.parameters.has('B')) state.speed_factor_kept = state.speed_factor;
    if (command.parameters.has('R')) state.speed_factor = state.speed_factor_kept;
    if (*percent) state.speed_factor = **percent / 100;
    interpreter.actions_.factors(state.speed_factor, state.flow_factor);
    return {};
}

Result<void> Handlers::flow_factor(Interpreter& interpreter, const Command& command) {
    const auto percent = number_within(command, 'S', kFactorPercentMin, kFactorPercentMax, "percent");
    if (!percent) return percent.error();
    ModalState& state = interpreter.state_;
    if (*percent) state.flow_factor = **percent / 100;
    interpreter.actions_.factors(state.speed_factor, state.flow_factor);
    return {};
}

Result<void> Handlers::nothing(Interpreter&, const Command&) { return {}; }

}  // namespace qduino::printer::gcode
