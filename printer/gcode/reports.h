// The machine's answers in Marlin's words, which hosts (OctoPrint, Pronterface) parse. Pure
// formatting.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "base/fixed_string.h"
#include "base/quantity.h"
#include "printer/gcode/actions.h"
#include "printer/gcode/position.h"

namespace qduino::printer::gcode {

using ReportText = FixedString<512>;

struct HeaterReading {
    Celsius temperature;
    Celsius target;
    double duty = 0;  ///< 0…1
};

struct FirmwareReport {
    std::string_view version;
    std::string_view machine;
    std::string_view uuid;
    bool auto_report = false;  ///< M155
    bool emergency_parser = true;
};

/// The printer's own estimate says both.
struct PrintProgress {
    Seconds passed;
    Seconds remaining;
};

/// M105: `T:201.50 /210.00 B:59.80 /60.00 @:64 B@:32`; the duty counts to 127, as Marlin's. Without
/// `ok `.
ReportText format_temperatures(const HeaterReading& hot_end, const std::optional<HeaterReading>& bed);
/// M114: `X:0.00 Y:127.00 Z:145.00 E:0.00 Count X:0 Y:10160 Z:116000`. `programmed`:
/// Interpreter::programmed_position(). `steps`: as pulses went out.
ReportText format_position(const Position& programmed, const PerAxis<std::int64_t>& steps);
/// M73 without a number: `M73 Progress: 37%; Time left: 25m`. 0 % until a job with an estimate
/// runs.
ReportText format_progress(const PrintProgress& progress);
/// M115: one line `FIRMWARE_NAME:…`, then `Cap:NAME:0|1` lines, each ended by LF but for the last.
ReportText format_firmware(const FirmwareReport& report);

/// `M301 P22.20 I1.08 D114.00`, of the bed `M304 …`: the line that would set these gains.
ReportText format_gains(Heater heater, const HeaterSettings& settings);
/// The same under the words that hosts wait for after M303.
ReportText format_tuned_gains(Heater heater, const HeaterSettings& settings);
/// `M306 P40.00 C21.98 R0.4000 A0.0900 F0.1125 H0.0053`, of the bed with E-1: the line that would
/// set this model. `filament_area_mm2`: H is for a millimetre of filament.
ReportText format_model(Heater heater, const HeaterModel& model, double filament_area_mm2);

}  // namespace qduino::printer::gcode
