#include "apps/machine_file/machine_file.h"

#include <gtest/gtest.h>

namespace qduino::apps {
namespace {

std::string error_of(std::string_view text) {
    const auto parsed = parse_machine(text, "m.toml");
    return parsed ? "" : std::string(parsed.error().message.view());
}

TEST(MachineFile, EmptyFileIsTheReferenceMachine) {
    const auto parsed = parse_machine("", "m.toml");
    ASSERT_TRUE(parsed);
    EXPECT_EQ(parsed->axes[2].steps_per_mm, 2020);
    EXPECT_EQ(parsed->name.view(), "Printrbot Simple Metal");
}

TEST(MachineFile, KeysReplaceValues) {
    const auto parsed = parse_machine(
        "[axes.x]\nmax_speed_mm_s = 200\nmax_acceleration_mm_s2 = 3000\n[bed]\nki = 1\n", "m.toml");
    ASSERT_TRUE(parsed);
    EXPECT_EQ(parsed->axes[0].max_speed_mm_s, 200);
    EXPECT_EQ(parsed->axes[0].max_acceleration_mm_s2, 3000);
    EXPECT_EQ(parsed->axes[1].max_speed_mm_s, 125);
    EXPECT_EQ(parsed->bed.ki, 1);
}

TEST(MachineFile, ErrorsNameFileLineAndKey) {
    EXPECT_EQ(error_of("\n[axes.x]\nspeed = 3\n"),
              "m.toml:3: 'speed' is not known here (docs/machine.md lists the keys)");
    EXPECT_EQ(error_of("has_bed = 1\n"), "m.toml:1: 'has_bed' is neither true nor false");
    EXPECT_EQ(error_of("[hot_end]\nmaximum_celsius = 900\n"),
              "m.toml:2: 'maximum_celsius' is 900, outside 30 to 500");
    EXPECT_EQ(error_of("[hot_end]\nkp = \"hot\"\n"), "m.toml:2: 'kp' is not a number");
    EXPECT_EQ(error_of("axes = 3\n"), "m.toml:1: 'axes' is not a table");
    EXPECT_NE(error_of("[axes.x\n").find("m.toml:1: "), std::string::npos);
    EXPECT_EQ(error_of("[axes.y]\nminimum_mm = 5\nmaximum_mm = 5\n"),
              "axis Y: minimum_mm is not below maximum_mm");
}

TEST(MachineFile, TheIdleTimeOutIsZeroOrLongEnoughToRead) {
    EXPECT_EQ(parse_machine("", "m.toml")->idle_timeout_s, 600);
    EXPECT_EQ(parse_machine("idle_timeout_s = 0\n", "m.toml")->idle_timeout_s, 0);
    EXPECT_EQ(parse_machine("idle_timeout_s = 1800\n", "m.toml")->idle_timeout_s, 1800);
    EXPECT_EQ(error_of("idle_timeout_s = 5\n"), "idle_timeout_s: give 0 (never) or at least 30 s");
    EXPECT_EQ(error_of("idle_timeout_s = -1\n"), "m.toml:1: 'idle_timeout_s' is -1, outside 0 to 86400");
    EXPECT_NE(error_of("idle_timeout_s = nan\n"), "");
}

TEST(MachineFile, TheParkPlaceFollowsTheBoundsAndStaysInside) {
    const auto reference = parse_machine("", "m.toml");
    EXPECT_TRUE(reference->park.enabled);
    EXPECT_EQ(reference->park.x_mm, 0);
    EXPECT_EQ(reference->park.y_mm, 150);
    const auto moved = parse_machine("[axes.x]\nminimum_mm = -10\n[axes.y]\nmaximum_mm = 90\n", "m.toml");
    ASSERT_TRUE(moved) << moved.error().message.view();
    EXPECT_EQ(moved->park.x_mm, -10);
    EXPECT_EQ(moved->park.y_mm, 90);
    const auto given = parse_machine(
        "[park]\nenabled = false\nx_mm = 5\nz_hop_mm = 12\nretract_mm = 0\nspeed_mm_s = "
        "40\nretract_speed_mm_s = 9\n",
        "m.toml");
    ASSERT_TRUE(given);
    EXPECT_FALSE(given->park.enabled);
    EXPECT_EQ(given->park.x_mm, 5);
    EXPECT_EQ(given->park.z_hop_mm, 12);
    EXPECT_EQ(error_of("[park]\nx_mm = 200\n"), "park: x_mm is 200, outside the axis' 0 to 150");
    EXPECT_EQ(error_of("[park]\nretract_mm = 90\n"), "m.toml:2: 'retract_mm' is 90, outside 0 to 20");
}

TEST(MachineFile, MissingFileIsNamed) {
    const auto parsed = read_machine_file("/nonexistent/m.toml");
    ASSERT_FALSE(parsed);
    EXPECT_NE(parsed.error().message.view().find("/nonexistent/m.toml"), std::string_view::npos);
}

}  // namespace
}  // namespace qduino::apps
