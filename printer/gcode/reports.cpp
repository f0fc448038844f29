#include "printer/gcode/reports.h"

#include <algorithm>
#include <cmath>

#include "printer/gcode/text.h"

namespace qduino::printer::gcode {
namespace {

constexpr double kDutyFull = 127;  // Marlin's soft PWM counts to 127

void append_reading(ReportText& out, std::string_view label, const HeaterReading& reading) {
    out.append(label).push_back(':');
    append_number(out, reading.temperature.value()).append(" /");
    append_number(out, reading.target.value());
}

void append_duty(ReportText& out, std::string_view label, const HeaterReading& reading) {
    out.append(label).push_back(':');
    append_integer(out, std::lround(std::clamp(reading.duty, 0.0, 1.0) * kDutyFull));
}

struct Capability {
    std::string_view name;
    bool present;
};

}  // namespace

ReportText format_temperatures(const TemperatureReport& report) {
    ReportText out;
    append_reading(out, "T", report.hot_end);
    if (report.has_bed) append_reading(out, " B", report.bed);
    append_duty(out, " @", report.hot_end);
    if (report.has_bed) append_duty(out, " B@", report.bed);
    return out;
}

ReportText format_position(const PositionReport& report) {
    ReportText out;
    for (const Axis axis : kAllAxes) {
        out.push_back(kAxisLetter[axis]).push_back(':');
        append_number(out, report.programmed[axis].value()).push_back(' ');
    }
    out.append("Count");
    for (const Axis axis : kToolAxes) {
        out.push_back(' ').push_back(kAxisLetter[axis]).push_back(':');
        append_integer(out, report.steps[axis]);
    }
    return out;
}

ReportText format_firmware(const FirmwareReport& report) {
    ReportText out{"FIRMWARE_NAME:QduinoMC "};
    append_printable(out, report.version.substr(0, 64));
    out.append(" PROTOCOL_VERSION:1.0 MACHINE_TYPE:");
    append_printable(out, report.machine.substr(0, 64));
    out.append(" EXTRUDER_COUNT:1 UUID:");
    append_printable(out, report.uuid.substr(0, 64));
    const Capability capabilities[] = {
        {"SERIAL_XON_XOFF", false},
        {"EEPROM", false},
        {"AUTOREPORT_TEMP", report.auto_report},
        {"PROGRESS", false},
        {"EMERGENCY_PARSER", report.emergency_parser},
        {"HOST_ACTION_COMMANDS", false},
    };
    for (const Capability& capability : capabilities) {
        out.append("\nCap:").append(capability.name).append(capability.present ? ":1" : ":0");
    }
    return out;
}

}  // namespace qduino::printer::gcode
