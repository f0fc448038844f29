// The machine's answers in Marlin's words, which hosts (OctoPrint, Pronterface) parse. Pure
// formatting.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "base/fixed_string.h"
#include "base/quantity.h"
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

/// M105: `T:201.50 /210.00 B:59.80 /60.00 @:64 B@:32`; the duty counts to 127, as Marlin's. Without
/// `ok `.
ReportText format_temperatures(const HeaterReading& hot_end, const std::optional<HeaterReading>& bed);
/// M114: `X:0.00 Y:127.00 Z:145.00 E:0.00 Count X:0 Y:10160 Z:116000`. `programmed`:
/// Interpreter::programmed_position(). `steps`: as pulses went out.
ReportText format_position(const Position& programmed, const PerAxis<std::int64_t>& steps);
/// M115: one line `FIRMWARE_NAME:…`, then `Cap:NAME:0|1` lines, each ended by LF but for the last.
ReportText format_firmware(const FirmwareReport& report);

}  // namespace qduino::printer::gcode
