// Input shaping and pressure advance: how the motion is changed on its way to the motors, so that
// the part comes out as drawn.
//
//   M593 F40 D0.1 X          Marlin: zero vibration (ZV); F0 switches it off
//   M593 P"mzv" F40 S0.1     RepRapFirmware: the type by name
//   M593 T2 F40              Prusa: the type by number
//   SET_INPUT_SHAPER SHAPER_TYPE_X=ei SHAPER_FREQ_X=40 DAMPING_RATIO_X=0.1     Klipper
//   M900 K0.05 · M572 D0 S0.05 · SET_PRESSURE_ADVANCE ADVANCE=0.05 SMOOTH_TIME=0.04
//
// Facts: marlinfw.org/docs/gcode/M593.html and M900.html; Duet's "GCode dictionary", M593 and M572;
// Prusa-Firmware-Buddy, M593; Klipper's documentation, "G-Codes".
#include <algorithm>
#include <string>

#include "printer/gcode/context.h"
#include "printer/gcode/text.h"
#include "printer/gcode/word_parameters.h"

namespace qduino::printer::gcode::handlers {
namespace {

struct NamedShaper {
    std::string_view name;  ///< upper case
    ShaperType type;
};
/// In the order of Prusa's numbers; what RepRapFirmware calls otherwise stands behind.
constexpr NamedShaper kShapers[]{
    {"ZV", ShaperType::zv},
    {"ZVD", ShaperType::zvd},
    {"MZV", ShaperType::mzv},
    {"EI", ShaperType::ei},
    {"2HUMP_EI", ShaperType::two_hump_ei},
    {"EI2", ShaperType::two_hump_ei},
    {"NONE", ShaperType::none},
};
constexpr int kNumbered = 5;
constexpr double kAdvanceOfMarlinMax = 10;

Result<ShaperType> shaper_named(std::string_view name) {
    FixedString<16> upper;
    for (const char c : name) upper.push_back(to_upper(c));
    const auto* const found = std::ranges::find(kShapers, upper.view(), &NamedShaper::name);
    if (found != std::ranges::end(kShapers)) return found->type;
    return make_error(ErrorCode::unsupported, "no input shaper ", name,
                      ": this printer has ZV, ZVD, MZV, EI and 2HUMP_EI");
}

/// 0 switches a shaper off; any other frequency is from the lowest to the highest.
Result<void> check_frequency(double hz) {
    if (hz == 0 || (hz >= kShaperFrequencyMin_hz && hz <= kShaperFrequencyMax_hz)) return {};
    return make_error(ErrorCode::out_of_range, "a shaper of ", Shortest{hz}, " Hz: give 0 (off), or ",
                      Shortest{kShaperFrequencyMin_hz}, " to ", Shortest{kShaperFrequencyMax_hz}, " Hz");
}

Result<void> advance_by(Context& context, std::optional<double> seconds) {
    if (!seconds) return {};
    CompensationChange change;
    change.advance = Seconds{*seconds};
    return context.actions.set_compensation(change);
}

/// One axis of SET_INPUT_SHAPER.
Result<CompensationChange::Shaper> shaper_of_axis(const Command& command, char axis) {
    const auto key = [&](std::string_view name) { return text<FixedString<24>>(name, '_', axis); };
    CompensationChange::Shaper shaper{.type_at_first = ShaperType::mzv};
    QDUINO_TRY_ASSIGN(shaper.frequency_hz, word_number(command, key("SHAPER_FREQ").view()));
    if (shaper.frequency_hz) QDUINO_TRY(check_frequency(*shaper.frequency_hz));
    QDUINO_TRY_ASSIGN(shaper.damping_ratio,
                      word_number_within(command, key("DAMPING_RATIO").view(), 0, kDampingRatioMax));
    auto type = word_value(command.text, key("SHAPER_TYPE").view());
    if (!type) type = word_value(command.text, "SHAPER_TYPE");
    if (type) {
        QDUINO_TRY_ASSIGN(const ShaperType named, shaper_named(*type));
        shaper.type = named;
    }
    return shaper;
}

}  // namespace

/// M593: X and Y name the axes; without them both.
Result<void> input_shaping(Context& context, const Command& command) {
    CompensationChange::Shaper shaper;
    QDUINO_TRY_ASSIGN(shaper.frequency_hz, number(command, 'F'));
    if (shaper.frequency_hz) QDUINO_TRY(check_frequency(*shaper.frequency_hz));
    QDUINO_TRY_ASSIGN(const auto damping, number_within(command, 'D', 0, kDampingRatioMax, ""));
    QDUINO_TRY_ASSIGN(const auto duet_damping, number_within(command, 'S', 0, kDampingRatioMax, ""));
    shaper.damping_ratio = damping ? damping : duet_damping;
    QDUINO_TRY_ASSIGN(const auto numbered, number_within(command, 'T', 0, kNumbered - 1, ""));
    if (numbered) shaper.type = kShapers[static_cast<std::size_t>(*numbered)].type;
    if (command.parameters.has('P')) {
        QDUINO_TRY_ASSIGN(const ShaperType named, shaper_named(trim(command.text.view())));
        shaper.type = named;
    }
    const bool both = !command.parameters.has('X') && !command.parameters.has('Y');
    CompensationChange change;
    if (both || command.parameters.has('X')) change.shapers[0] = shaper;
    if (both || command.parameters.has('Y')) change.shapers[1] = shaper;
    return context.actions.set_compensation(change);
}

/// SET_INPUT_SHAPER SHAPER_FREQ_X= SHAPER_FREQ_Y= DAMPING_RATIO_X= … SHAPER_TYPE= SHAPER_TYPE_X= …
Result<void> set_input_shaper(Context& context, const Command& command) {
    CompensationChange change;
    QDUINO_TRY_ASSIGN(change.shapers[0], shaper_of_axis(command, 'X'));
    QDUINO_TRY_ASSIGN(change.shapers[1], shaper_of_axis(command, 'Y'));
    return context.actions.set_compensation(change);
}

/// M900 K. L, S and T choose among Marlin's sets of factors: there is one. Marlin passes a K above
/// 10 over: Prusa's profiles write one behind the other, for firmware of before 2018.
Result<void> linear_advance(Context& context, const Command& command) {
    QDUINO_TRY_ASSIGN(const auto given, number(command, 'K'));
    if (given.value_or(0) > kAdvanceOfMarlinMax) {
        context.warn(
            text("M900 K", Shortest{*given}, " is a factor of Linear Advance 1.0: it changes nothing"));
        return {};
    }
    QDUINO_TRY_ASSIGN(const auto seconds, number_within(command, 'K', 0, kAdvanceMax.value(), "s"));
    return advance_by(context, seconds);
}

/// M572 D0 S0.05; of a tool that is not there it changes nothing.
Result<void> pressure_advance(Context& context, const Command& command) {
    QDUINO_TRY_ASSIGN(const auto tool, number(command, 'D'));
    QDUINO_TRY_ASSIGN(const auto seconds, number_within(command, 'S', 0, kAdvanceMax.value(), "s"));
    return tool.value_or(0) == 0 ? advance_by(context, seconds) : Result<void>{};
}

/// SET_PRESSURE_ADVANCE ADVANCE= SMOOTH_TIME=.
Result<void> set_pressure_advance(Context& context, const Command& command) {
    if (word_value(command.text, "EXTRUDER").value_or("extruder") != "extruder")
        return make_error(ErrorCode::unsupported, "this machine has one tool, T0");
    QDUINO_TRY_ASSIGN(const auto advance, word_number_within(command, "ADVANCE", 0, kAdvanceMax.value()));
    QDUINO_TRY_ASSIGN(const auto smooth,
                      word_number_within(command, "SMOOTH_TIME", 0, kSmoothTimeMax.value()));
    CompensationChange change;
    if (advance) change.advance = Seconds{*advance};
    if (smooth) change.smooth_time = std::max(Seconds{*smooth}, kSmoothTimeMin);
    if (!advance && !smooth) return {};
    return context.actions.set_compensation(change);
}

}  // namespace qduino::printer::gcode::handlers
