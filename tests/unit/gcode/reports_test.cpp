#include "printer/gcode/reports.h"

#include <gtest/gtest.h>

namespace qduino::printer::gcode::reports_test {
namespace {

TEST(Reports, Temperatures) {
    const HeaterReading hot_end{Celsius{201.5}, Celsius{210}, 0.5};
    EXPECT_EQ(format_temperatures(hot_end, std::nullopt).view(), "T:201.50 /210.00 @:64");
    EXPECT_EQ(format_temperatures(hot_end, HeaterReading{Celsius{59.8}, Celsius{60}, 0.25}).view(),
              "T:201.50 /210.00 B:59.80 /60.00 @:64 B@:32");
}

TEST(Reports, Position) {
    Position programmed{};
    programmed[Axis::y] = Millimetres{127};
    programmed[Axis::z] = Millimetres{145};
    EXPECT_EQ(format_position(programmed, {0, 10160, 116000, 7}).view(),
              "X:0.00 Y:127.00 Z:145.00 E:0.00 Count X:0 Y:10160 Z:116000");
}

TEST(Reports, Firmware) {
    FirmwareReport report;
    report.version = "0.2";
    report.machine = "Printrbot\nSimple Metal";
    report.uuid = "cede2a2f-41a2-4748-9b12-c55c62f367ff";
    const ReportText text = format_firmware(report);
    EXPECT_EQ(text.view().substr(0, text.view().find('\n')),
              "FIRMWARE_NAME:QduinoMC 0.2 PROTOCOL_VERSION:1.0 MACHINE_TYPE:Printrbot?Simple Metal "
              "EXTRUDER_COUNT:1 "
              "UUID:cede2a2f-41a2-4748-9b12-c55c62f367ff");
    EXPECT_NE(text.view().find("\nCap:AUTOREPORT_TEMP:0"), std::string_view::npos);
    EXPECT_NE(text.view().find("\nCap:EMERGENCY_PARSER:1"), std::string_view::npos);
    report.auto_report = true;
    EXPECT_NE(format_firmware(report).view().find("\nCap:AUTOREPORT_TEMP:1"), std::string_view::npos);
}

TEST(Reports, ProgressIsByTheEstimate) {
    EXPECT_EQ(format_progress({Seconds{370}, Seconds{630}}).view(), "M73 Progress: 37%; Time left: 11m");
    EXPECT_EQ(format_progress({}).view(), "M73 Progress: 0%; Time left: 0m");
    EXPECT_EQ(format_progress({Seconds{999.9}, Seconds{0.1}}).view(), "M73 Progress: 99%; Time left: 1m")
        << "not yet";
}

}  // namespace
}  // namespace qduino::printer::gcode::reports_test
