#include "printer/gcode/reports.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "printer/gcode/text.h"

namespace qduino::printer::gcode {
namespace {

constexpr double kDutyFull = 127;  // Marlin's soft PWM counts to 127

void write_reading(ReportText& out, std::string_view label, const HeaterReading& reading) {
    write(out, label, ':', Fixed{reading.temperature.value()}, " /", Fixed{reading.target.value()});
}

void write_duty(ReportText& out, std::string_view label, const HeaterReading& reading) {
    write(out, label, ':', std::lround(std::clamp(reading.duty, 0.0, 1.0) * kDutyFull));
}

}  // namespace

ReportText format_temperatures(const HeaterReading& hot_end, const std::optional<HeaterReading>& bed) {
    ReportText out;
    write_reading(out, "T", hot_end);
    if (bed) write_reading(out, " B", *bed);
    write_duty(out, " @", hot_end);
    if (bed) write_duty(out, " B@", *bed);
    return out;
}

ReportText format_position(const Position& programmed, const PerAxis<std::int64_t>& steps) {
    ReportText out;
    for (const Axis axis : kAllAxes) {
        write(out, kAxisLetter[axis], ':', Fixed{programmed[axis].value()}, ' ');
    }
    out.append("Count");
    for (const Axis axis : kToolAxes) write(out, ' ', kAxisLetter[axis], ':', steps[axis]);
    return out;
}

ReportText format_progress(const PrintProgress& progress) {
    const double whole_s = (progress.passed + progress.remaining).value();
    const double percent = whole_s > 0 ? 100 * progress.passed.value() / whole_s : 0;
    return text<ReportText>("M73 Progress: ", Fixed{std::floor(percent), 0},
                            "%; Time left: ", Fixed{std::ceil(progress.remaining.value() / 60), 0}, "m");
}

ReportText format_firmware(const FirmwareReport& report) {
    ReportText out{"FIRMWARE_NAME:QduinoMC "};
    append_printable(out, report.version.substr(0, 64));
    out.append(" PROTOCOL_VERSION:1.0 MACHINE_TYPE:");
    append_printable(out, report.machine.substr(0, 64));
    out.append(" EXTRUDER_COUNT:1 UUID:");
    append_printable(out, report.uuid.substr(0, 64));
    const std::pair<std::string_view, bool> capabilities[] = {
        {"SERIAL_XON_XOFF", false},
        {"EEPROM", false},
        {"AUTOREPORT_TEMP", report.auto_report},
        {"PROGRESS", false},
        {"EMERGENCY_PARSER", report.emergency_parser},
        {"HOST_ACTION_COMMANDS", false},
    };
    for (const auto& [name, present] : capabilities) write(out, "\nCap:", name, present ? ":1" : ":0");
    return out;
}

ReportText format_gains(Heater heater, const HeaterSettings& settings) {
    ReportText out{heater == Heater::bed ? "M304" : "M301"};
    write(out, " P", Fixed{settings.kp}, " I", Fixed{settings.ki, 4}, " D", Fixed{settings.kd});
    return out;
}

ReportText format_tuned_gains(Heater heater, const HeaterSettings& settings) {
    ReportText out{"PID Autotune finished! Kp: "};
    write(out, Fixed{settings.kp}, " Ki: ", Fixed{settings.ki, 4}, " Kd: ", Fixed{settings.kd}, '\n');
    return out.append(format_gains(heater, settings));
}

ReportText format_model(Heater heater, const HeaterModel& model, double filament_area_mm2) {
    ReportText out{"M306"};
    if (heater == Heater::bed) out.append(" E-1");
    write(out, " P", Fixed{model.power_w}, " C", Fixed{model.heat_capacity_j_k}, " R",
          Fixed{1 / model.sensor_lag_s, 4}, " A", Fixed{model.loss_w_k, 4}, " F",
          Fixed{model.loss_w_k + model.fan_loss_w_k, 4}, " H",
          Fixed{model.filament_j_mm3_k * filament_area_mm2, 4});
    return out;
}

}  // namespace qduino::printer::gcode
