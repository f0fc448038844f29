// The numbers of the heaters: M301, M303, M304, M306, and M500 to M503, which keep them.
//
// Letters and units are Marlin's (marlinfw.org: M301, M303, M304, M306). Where Marlin knows the
// model of a hot end alone, `E-1` means the bed here, as in its M303.
#include "printer/gcode/context.h"

namespace qduino::printer::gcode::handlers {
namespace {

constexpr double kGainMax = 10'000;
constexpr double kPowerMax_w = 5000;
constexpr double kCapacityMax_j_k = 50'000;
constexpr double kLossMax_w_k = 100;
constexpr double kFilamentMax_j_mm_k = 1;
constexpr double kResponsivenessMin_hz = 0.01;  // a lag of 100 s
constexpr double kResponsivenessMax_hz = 10;
constexpr double kAlmostNothing = 1e-4;
constexpr int kSwingsFewest = 3;
constexpr int kSwingsMost = 20;
/// Below this a room may be as warm.
constexpr double kTunedAtLeast = 50;

Result<Heater> heater_of(const Command& command) {
    QDUINO_TRY_ASSIGN(const auto given, number(command, 'E'));
    const double which = given.value_or(0);
    if (which == 0) return Heater::hot_end;
    if (which == -1) return Heater::bed;
    return make_error(ErrorCode::unsupported, "this machine has one hot end, E0; E-1 is the bed");
}

Result<void> check_bed(const Context& context, Heater heater) {
    if (heater == Heater::hot_end || context.config.has_bed) return {};
    return make_error(ErrorCode::unsupported, "this machine has no heated bed");
}

Result<void> gains(Context& context, const Command& command, Heater heater) {
    QDUINO_TRY(check_bed(context, heater));
    HeaterChange change;
    QDUINO_TRY_ASSIGN(change.kp, number_within(command, 'P', 0, kGainMax, "per °C"));
    QDUINO_TRY_ASSIGN(change.ki, number_within(command, 'I', 0, kGainMax, "per °C·s"));
    QDUINO_TRY_ASSIGN(change.kd, number_within(command, 'D', 0, kGainMax, "per °C/s"));
    if (!change.kp && !change.ki && !change.kd) {
        context.actions.report(heater == Heater::bed ? Report::bed_gains : Report::hot_end_gains);
        return {};
    }
    return context.actions.set_heater(heater, change);
}

/// Where an experiment swings or rests: S, or what Marlin takes.
Result<void> tune(Context& context, const Command& command, TuningAsked asked, double usual_celsius) {
    QDUINO_TRY(check_bed(context, asked.heater));
    const bool bed = asked.heater == Heater::bed;
    const double highest = highest_target(bed ? context.config.bed : context.config.hot_end).value();
    QDUINO_TRY_ASSIGN(const auto target, number_within(command, 'S', kTunedAtLeast, highest, "°C"));
    asked.target = Celsius{target.value_or(std::min(usual_celsius, highest))};
    return context.actions.tune_heater(asked);
}

Result<HeaterChange> model_change(const Context& context, const Command& command) {
    HeaterChange change;
    QDUINO_TRY_ASSIGN(change.power_w, number_within(command, 'P', 1, kPowerMax_w, "W"));
    QDUINO_TRY_ASSIGN(change.heat_capacity_j_k, number_within(command, 'C', 0.1, kCapacityMax_j_k, "J/K"));
    QDUINO_TRY_ASSIGN(change.loss_w_k, number_within(command, 'A', kAlmostNothing, kLossMax_w_k, "W/K"));
    QDUINO_TRY_ASSIGN(change.loss_with_fan_w_k, number_within(command, 'F', 0, kLossMax_w_k, "W/K"));
    QDUINO_TRY_ASSIGN(const auto per_mm, number_within(command, 'H', 0, kFilamentMax_j_mm_k, "J/K in a mm"));
    if (per_mm) change.filament_j_mm3_k = *per_mm / filament_area_mm2(context.config);
    QDUINO_TRY_ASSIGN(const auto responsiveness,
                      number_within(command, 'R', kResponsivenessMin_hz, kResponsivenessMax_hz, "1/s"));
    if (responsiveness) change.sensor_lag_s = 1 / *responsiveness;
    return change;
}

}  // namespace

/// E: which hot end (Marlin). H: which heater, in RepRapFirmware, whose gains count otherwise.
Result<void> hot_end_gains(Context& context, const Command& command) {
    QDUINO_TRY_ASSIGN(const auto hot_end, number(command, 'E'));
    if (hot_end.value_or(0) != 0) return {};  // of one that is not there
    if (command.parameters.has('H'))
        return make_error(ErrorCode::unsupported, "H is RepRapFirmware's, whose gains count otherwise");
    return gains(context, command, Heater::hot_end);
}
Result<void> bed_gains(Context& i, const Command& c) { return gains(i, c, Heater::bed); }

Result<void> tune_gains(Context& context, const Command& command) {
    QDUINO_TRY_ASSIGN(const Heater heater, heater_of(command));
    QDUINO_TRY_ASSIGN(const auto swings, number_within(command, 'C', kSwingsFewest, kSwingsMost, "swings"));
    QDUINO_TRY_ASSIGN(const auto use, number(command, 'U'));
    const TuningAsked asked{.heater = heater,
                            .kind = HeaterControl::pid,
                            .swings = static_cast<int>(swings.value_or(5)),
                            .use = use.value_or(0) != 0};
    return tune(context, command, asked, heater == Heater::bed ? 70 : 150);
}

/// The numbers of a model, `T`: find them.
Result<void> heater_model(Context& context, const Command& command) {
    QDUINO_TRY_ASSIGN(const Heater heater, heater_of(command));
    QDUINO_TRY(check_bed(context, heater));
    QDUINO_TRY_ASSIGN(const HeaterChange change, model_change(context, command));
    const bool tunes = command.parameters.has('T');
    const bool changes = change.power_w || change.heat_capacity_j_k || change.loss_w_k ||
                         change.loss_with_fan_w_k || change.filament_j_mm3_k || change.sensor_lag_s;
    if (!tunes && !changes) {
        context.actions.report(heater == Heater::bed ? Report::bed_model : Report::hot_end_model);
        return {};
    }
    if (changes) {
        QDUINO_TRY(context.actions.set_heater(heater, change));
    }
    if (!tunes) return {};
    const TuningAsked asked{.heater = heater, .kind = HeaterControl::model, .use = true};
    return tune(context, command, asked, heater == Heater::bed ? 60 : 200);
}

Result<void> keep_settings(Context& i, const Command&) { return i.actions.settings(SettingsAsked::keep); }
Result<void> restore_settings(Context& i, const Command&) {
    return i.actions.settings(SettingsAsked::restore);
}
Result<void> factory_settings(Context& i, const Command&) {
    return i.actions.settings(SettingsAsked::factory);
}
void report_settings(Context& i, const Command&) { i.actions.report(Report::heat_settings); }

}  // namespace qduino::printer::gcode::handlers
