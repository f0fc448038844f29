// The lines of a serial host in the machine: when each is over, who is answered, and what they do
// not share with a person's.
#include "printer/machine/host_lines.h"

#include <gtest/gtest.h>

#include "tests/unit/machine/fake_loops.h"

namespace qduino::printer::machine::host_lines_test {
namespace {

using gcode::Ok;
using link::Command;

TEST(HostLines, EachKindIsOverAtItsTime) {
    struct Row {
        Ok ok;
        bool at_once, done, still;
    };
    for (const Row& row : {Row{Ok::at_once, true, true, true}, Row{Ok::when_done, false, true, true},
                           Row{Ok::when_still, false, false, true}}) {
        const auto over = [&](bool done, bool still) {
            HostLines lines;
            lines.begin(row.ok);
            lines.settle(done, still);
            EXPECT_EQ(lines.over(), lines.in_hand() ? 0u : 1u);
            return lines.over() == 1;
        };
        EXPECT_EQ(over(false, false), row.at_once);
        EXPECT_EQ(over(true, false), row.done);
        EXPECT_EQ(over(true, true), row.still);
    }
}

TEST(HostLines, AHeldLineWaitsAndADroppedOneIsOver) {
    HostLines lines;
    lines.begin(Ok::when_still);
    lines.hold();
    lines.settle(true, true);
    EXPECT_TRUE(lines.in_hand());
    lines.let_go();
    lines.settle(true, true);
    EXPECT_EQ(lines.over(), 1u);
    lines.begin(Ok::when_done);
    lines.drop(4);
    lines.refuse();
    EXPECT_EQ(lines.over(), 7u);
    EXPECT_FALSE(lines.in_hand());
}

/// A machine, and a host that begins.
class HostBench : public MachineBench {
  public:
    HostBench() {
        run();
        command(Command::host_line, "");
    }
    void send(std::string_view line) { command(Command::host_line, line); }
    [[nodiscard]] std::uint64_t over() { return status().host_lines; }
};

TEST(MachineHost, MovesAreOverWhenTheyArePlannedAndM400WhenTheyArePlayed) {
    HostBench bench;
    for (const char* line : {"G28", "G1 X100 F600", "M400", "G1 X20"}) bench.send(line);
    ASSERT_TRUE(bench.run_until([&] { return bench.over() == 2; })) << bench.replies;
    EXPECT_TRUE(bench.status().homed[0]);
    std::int64_t played = 0;
    while (bench.over() == 2) {
        played = bench.loop2->steps()[0];
        bench.run();
    }
    EXPECT_EQ(played, 8000 - 100) << "nothing of the last line before";
    ASSERT_TRUE(bench.run_until([&] { return bench.loop2->steps()[0] == 1600 - 100; }));
    EXPECT_EQ(bench.over(), 4u);
}

TEST(MachineHost, WhatItAsksForHappensAtItsPlaceInTheMotion) {
    HostBench bench;
    for (const char* line : {"G28", "M400", "G1 X100 F600", "M106 S255"}) bench.send(line);
    ASSERT_TRUE(bench.run_until([&] { return bench.over() == 3; }));
    EXPECT_EQ(bench.heat().fan_duty, 0);
    bench.command(Command::gcode, "M106 S51");
    bench.run(2);
    EXPECT_EQ(bench.heat().fan_duty, 0.2) << "a person's is at once";
    ASSERT_TRUE(bench.run_until([&] { return bench.heat().fan_duty == 1; }));
    EXPECT_EQ(bench.loop2->steps()[0], 8000 - 100);
}

TEST(MachineHost, LinesThatAreRefusedOrDroppedAreOver) {
    HostBench bench;
    bench.send("G28");
    bench.send("G1 X9000");
    ASSERT_TRUE(bench.run_until([&] { return bench.over() == 2; }));
    EXPECT_NE(bench.replies.find("line 1, G1: X"), std::string::npos) << bench.replies;
    for (const char* line : {"M109 S200", "G1 X10", "G1 X20"}) bench.send(line);
    bench.run(2);
    EXPECT_EQ(bench.over(), 2u);
    bench.link->emergency.fetch_add(1);
    bench.run(3);
    EXPECT_EQ(bench.over(), 5u);
    bench.send("G28");
    bench.run();
    EXPECT_EQ(bench.over(), 6u);
    EXPECT_NE(bench.replies.find("G28 was not done: the machine has a fault"), std::string::npos);
}

TEST(MachineHost, M108EndsTheWaitForHeatAndM0s) {
    HostBench bench;
    bench.send("M109 S200");
    bench.run(5);
    EXPECT_EQ(bench.over(), 0u);
    bench.send("M108");
    bench.run();
    EXPECT_EQ(bench.over(), 2u);
    bench.send("M0");
    bench.run(5);
    EXPECT_EQ(bench.over(), 2u);
    bench.command(Command::gcode, "M108");
    bench.run();
    EXPECT_EQ(bench.over(), 3u) << "whoever says it";
}

TEST(MachineHost, M410DropsMovesAndLines) {
    HostBench bench;
    for (const char* line : {"G28", "M400", "G1 X100 F600", "M400", "G1 X20", "G1 X30"}) bench.send(line);
    ASSERT_TRUE(bench.run_until([&] { return bench.over() == 3; }));
    bench.run();
    bench.send("M410");
    bench.run(3);
    EXPECT_EQ(bench.over(), 7u);
    EXPECT_EQ(bench.status().state, State::idle);
    const auto stopped = bench.loop2->steps();
    EXPECT_LT(stopped[0], 8000 - 100);
    bench.run(30);
    EXPECT_EQ(bench.loop2->steps(), stopped);
    EXPECT_NEAR(bench.status().position_mm[0], static_cast<double>(stopped[0] + 100) / 80, 0.01);
}

TEST(MachineHost, M410LeavesAJobAlone) {
    HostBench bench;
    bench.job("G28\nG1 X100 F600\n");
    ASSERT_TRUE(bench.reaches(State::printing));
    bench.command(Command::gcode, "M410");
    bench.run();
    EXPECT_NE(bench.replies.find("M410 was not taken"), std::string::npos) << bench.replies;
    ASSERT_TRUE(bench.reaches(State::idle));
    EXPECT_EQ(bench.loop2->steps()[0], 8000 - 100);
}

TEST(MachineHost, AHostBeginsWithTheModesOfTheStart) {
    HostBench bench;
    for (const char* line : {"G28", "G91", "M83", "G1 X10 F6000"}) bench.send(line);
    bench.send("");
    bench.send("G1 X10");
    ASSERT_TRUE(bench.run_until([&] { return bench.over() == 5; }));
    bench.run(5);
    EXPECT_NEAR(bench.status().position_mm[0], 10, 1e-9) << "absolute";
    EXPECT_TRUE(bench.status().homed[0]) << "and homed";
}

}  // namespace
}  // namespace qduino::printer::machine::host_lines_test
