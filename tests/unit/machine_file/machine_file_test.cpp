#include "apps/machine_file/machine_file.h"

#include <gtest/gtest.h>

namespace qduino::apps::machine_file_test {
namespace {

using printer::Axis;

std::string error_of(std::string_view text) {
    const auto parsed = parse_machine(text, "m.toml");
    return parsed ? "" : std::string(parsed.error().message.view());
}

TEST(MachineFile, EmptyFileIsTheReferenceMachine) {
    const auto parsed = parse_machine("", "m.toml");
    ASSERT_TRUE(parsed);
    EXPECT_EQ(parsed->axes[Axis::z].steps_per_mm, 2020);
    EXPECT_EQ(parsed->name.view(), "Printrbot Simple Metal");
}

TEST(MachineFile, KeysReplaceValues) {
    const auto parsed = parse_machine(
        "[axes.x]\nmax_speed_mm_s = 200\nmax_acceleration_mm_s2 = 3000\n[bed]\nki = 1\n", "m.toml");
    ASSERT_TRUE(parsed);
    EXPECT_EQ(parsed->axes[Axis::x].max_speed, 200_mm_s);
    EXPECT_EQ(parsed->axes[Axis::x].max_acceleration, 3000_mm_s2);
    EXPECT_EQ(parsed->axes[Axis::y].max_speed, 125_mm_s);
    EXPECT_EQ(parsed->bed.ki, 1);
}

TEST(MachineFile, ErrorsNameFileLineAndKey) {
    EXPECT_TRUE(error_of("\n[axes.x]\nspeed = 3\n")
                    .starts_with(
                        "m.toml:3: [axes.x] 'speed' is not known; accepted: steps_per_mm, max_speed_mm_s, "));
    EXPECT_EQ(error_of("has_bed = 1\n"), "m.toml:1: 'has_bed' is 1; accepted: true or false");
    EXPECT_EQ(error_of("[hot_end]\nmaximum_celsius = 900\n"),
              "m.toml:2: [hot_end] 'maximum_celsius' is 900; accepted: a number from 30 to 500");
    EXPECT_EQ(error_of("[hot_end]\nkp = \"hot\"\n"),
              "m.toml:2: [hot_end] 'kp' is 'hot'; accepted: a number from 0 to 10000");
    EXPECT_EQ(error_of("fan_pin = 128\n"),
              "m.toml:1: 'fan_pin' is 128; accepted: a whole number from 0 to 127");
    EXPECT_EQ(error_of("axes = 3\n"), "m.toml:1: 'axes' is 3; accepted: a table, [axes]");
    EXPECT_NE(error_of("[axes.x\n").find("m.toml:1: "), std::string::npos);
    EXPECT_EQ(error_of("[axes.y]\nminimum_mm = 5\nmaximum_mm = 5\n"),
              "axis Y: minimum_mm is not below maximum_mm");
}

TEST(MachineFile, TheIdleTimeOutIsZeroOrLongEnoughToRead) {
    EXPECT_EQ(parse_machine("", "m.toml")->idle_timeout, Seconds{600});
    EXPECT_EQ(parse_machine("idle_timeout_s = 0\n", "m.toml")->idle_timeout, Seconds{0});
    EXPECT_EQ(parse_machine("idle_timeout_s = 1800\n", "m.toml")->idle_timeout, Seconds{1800});
    EXPECT_EQ(error_of("idle_timeout_s = 5\n"), "idle_timeout_s: give 0 (never) or at least 30 s");
    EXPECT_EQ(error_of("idle_timeout_s = -1\n"),
              "m.toml:1: 'idle_timeout_s' is -1; accepted: a number from 0 to 86400");
    EXPECT_NE(error_of("idle_timeout_s = nan\n"), "");
}

TEST(MachineFile, TheParkPlaceFollowsTheBoundsAndStaysInside) {
    const auto reference = parse_machine("", "m.toml");
    EXPECT_TRUE(reference->park.enabled);
    EXPECT_EQ(reference->park.x, 0_mm);
    EXPECT_EQ(reference->park.y, 150_mm);
    const auto moved = parse_machine("[axes.x]\nminimum_mm = -10\n[axes.y]\nmaximum_mm = 90\n", "m.toml");
    ASSERT_TRUE(moved) << moved.error().message.view();
    EXPECT_EQ(moved->park.x, -10_mm);
    EXPECT_EQ(moved->park.y, 90_mm);
    const auto given = parse_machine(
        "[park]\nenabled = false\nx_mm = 5\nz_hop_mm = 12\nretract_mm = 0\nspeed_mm_s = "
        "40\nretract_speed_mm_s = 9\n",
        "m.toml");
    ASSERT_TRUE(given);
    EXPECT_FALSE(given->park.enabled);
    EXPECT_EQ(given->park.x, 5_mm);
    EXPECT_EQ(given->park.z_hop, 12_mm);
    EXPECT_EQ(error_of("[park]\nx_mm = 200\n"), "park: x_mm is 200, outside the axis' 0 to 150");
    EXPECT_EQ(error_of("[park]\nretract_mm = 90\n"),
              "m.toml:2: [park] 'retract_mm' is 90; accepted: a number from 0 to 20");
}

TEST(MachineFile, TheLargestTargetsAre15DegreesBelowTheFault) {
    const auto machine = parse_machine("[bed]\nmaximum_celsius = 100\n", "m.toml");
    ASSERT_TRUE(machine);
    EXPECT_EQ(highest_target(machine->hot_end), 260_celsius);
    EXPECT_EQ(highest_target(machine->bed), 85_celsius);
}

TEST(MachineFile, TheShortestStepIntervalHoldsPulseLowTimeAndBothSidesOfAChangeOfDirection) {
    EXPECT_EQ(step_interval(*parse_machine("", "m.toml")), 2us) << "the set-up passes inside the low time";
    const auto slow_to_turn =
        parse_machine("step_pulse_s = 2e-6\nstep_low_s = 1e-6\ndirection_setup_s = 5e-6\n", "m.toml");
    EXPECT_EQ(step_interval(*slow_to_turn), 10us);
    EXPECT_EQ(step_interval(*parse_machine("step_pulse_s = 3e-6\nstep_low_s = 2.5e-6\n", "m.toml")), 5500ns);
}

TEST(MachineFile, MacrosAreWordsWithTheirLines) {
    const auto machine =
        parse_machine("[macros]\nprint_start = '''\nG28\nM109 S{T}'''\nEND = 'M84'\n", "m.toml");
    ASSERT_TRUE(machine) << machine.error().message.view();
    ASSERT_EQ(machine->macros.size(), 2U);
    EXPECT_EQ(machine->macros[0].name.view(), "END");
    EXPECT_EQ(machine->macros[1].name.view(), "PRINT_START");
    EXPECT_EQ(machine->macros[1].text.view(), "G28\nM109 S{T}");
    EXPECT_EQ(error_of("[macros]\nEND = 5\n"), "m.toml:2: [macros] 'END' is 5; accepted: a text");
    EXPECT_NE(error_of("[macros]\nE = 'M84'\n").find("'E' is no word of 2 to 32 letters"), std::string::npos);
    EXPECT_NE(
        error_of("[macros]\nEND = '" + std::string(769, 'x') + "'\n").find("'END' has more than 768 bytes"),
        std::string::npos);
    std::string many = "[macros]\n";
    for (int i = 0; i < 13; ++i) many += "MACRO_" + std::to_string(i) + " = 'M84'\n";
    EXPECT_NE(error_of(many).find("is one macro more than 12"), std::string::npos);
}

TEST(MachineFile, MissingFileIsNamed) {
    const auto parsed = read_machine_file("/nonexistent/m.toml");
    ASSERT_FALSE(parsed);
    EXPECT_NE(parsed.error().message.view().find("/nonexistent/m.toml"), std::string_view::npos);
}

}  // namespace
}  // namespace qduino::apps::machine_file_test
