// What is done while a job prints takes hold at once: no more is planned ahead than the motors
// need. Times are the print's own.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <tuple>
#include <vector>

#include "tests/scenario/printer/printer_bench.h"
#include "twin/report.h"

namespace qduino::tests::live_test {
namespace {

using link::JobOutcome;

/// Longer than anything may take to take hold.
constexpr double kAtOnce_s = 2;

/// Lines of 100 mm, `speed` mm/s, there and back, with so much filament in each.
std::string lines(int count, double speed, double filament_mm = 0) {
    std::string text = "G28\nG1 X10 Y10 Z1 F6000\nM83\n";
    for (int i = 0; i < count; ++i)
        text += "G1 X" + std::string(i % 2 == 0 ? "110" : "10") + " E" + std::to_string(filament_mm) + " F" +
                std::to_string(speed * 60) + "\n";
    return text;
}

printer::MachineConfig cold_machine() {
    printer::MachineConfig config;
    config.minimum_extrude = Celsius{0};
    return config;
}

class Live : public PrinterBench {
  public:
    explicit Live(const printer::MachineConfig& config = cold_machine()) : PrinterBench(config) {}
    /// A job that is in its lines.
    void start(const std::string& text) {
        ASSERT_TRUE(begin());
        job(text);
        ASSERT_TRUE(run_until([&] { return status().homed[2] && metal().position_mm[0] > 20; }, 120));
        run(2);
    }
    /// mm/s of the head, over 0.2 s; the turns at the ends of lines are left out.
    double speed_mm_s(int axis = 0) {
        double best = 0;
        for (int i = 0; i < 5; ++i) {
            const double before = metal().position_mm[static_cast<std::size_t>(axis)];
            run(0.2);
            best =
                std::max(best, std::abs(metal().position_mm[static_cast<std::size_t>(axis)] - before) / 0.2);
        }
        return best;
    }
};

TEST(LiveChanges, M220TakesHoldAtOnceInLongLines) {
    Live bench;
    bench.start(lines(40, 5));  // 20 s each
    EXPECT_NEAR(bench.speed_mm_s(), 5, 0.1);
    bench.type("M220 S400");
    bench.run(kAtOnce_s);
    EXPECT_NEAR(bench.speed_mm_s(), 20, 0.2);
    bench.type("M220 S50");
    bench.run(kAtOnce_s);
    EXPECT_NEAR(bench.speed_mm_s(), 2.5, 0.1);
}

TEST(LiveChanges, M220TakesHoldAtOnceInAnArc) {
    Live arc;
    arc.start("G28\nG1 X110 Y60 Z1 F6000\nG3 X110 Y60 I-40 J0 F300\nG3 X110 Y60 I-40 J0\n");
    arc.type("M220 S400");
    arc.run(kAtOnce_s);
    const auto before = arc.metal().position_mm;
    arc.run(0.5);
    const auto behind = arc.metal().position_mm;
    EXPECT_NEAR(std::hypot(behind[0] - before[0], behind[1] - before[1]), 10, 0.3);
}

TEST(LiveChanges, M220TakesHoldAtOnceInShortLines) {
    std::string text = "G28\nG1 X10 Y10 Z1 F6000\n";
    for (int i = 1; i <= 2000; ++i) text += "G1 X" + std::to_string(10 + 0.05 * i) + " F120\n";
    Live fine;
    fine.start(text);
    fine.type("M220 S400");
    fine.run(kAtOnce_s);
    EXPECT_NEAR(fine.speed_mm_s(), 8, 0.2);
}

TEST(LiveChanges, M221TakesHoldAtOnceInALongLine) {
    Live bench;
    bench.start(lines(40, 5, 10));  // 0.5 mm/s of filament
    EXPECT_NEAR(bench.speed_mm_s(3), 0.5, 0.06);
    bench.type("M221 S200");
    bench.run(kAtOnce_s);
    EXPECT_NEAR(bench.speed_mm_s(3), 1, 0.06);
}

/// The twin is told what was typed, and where in the line it has taken hold: it asks for exactly
/// what was laid down. Shorter and longer lines, more and less, twice in one line, in a pause, over
/// an arc, in the last line.
TEST(LiveChanges, TheTwinAsksForTheFlowThatWasTyped) {
    struct Said {
        double after_s;
        std::string line;
    };
    const std::string arcs =
        "G28\nG1 X110 Y60 Z1 F6000\nM83\nG3 X110 Y60 I-40 J0 E5 F1200\nG3 X110 Y60 I-40 J0 E5\nG1 X30 E4 "
        "F600\nG1 E-1 F600\nG1 X100 E3\nG1 E1\nG1 X50 E2\n";
    const std::vector<std::tuple<std::string, std::string, std::vector<Said>>> cases{
        {"a long line", lines(6, 5, 4), {{3, "M221 S200"}, {30, "M221 S50"}}},
        {"twice in a line", lines(4, 5, 4), {{2, "M221 S150"}, {3, "M221 S80"}}},
        {"short lines", lines(60, 100, 0.4), {{3, "M221 S130"}, {5, "M221 S70"}}},
        {"the last line", lines(2, 5, 4), {{28, "M221 S200"}}},
        {"arcs and retractions", arcs, {{2, "M221 S150"}, {12, "M221 S90"}}},
    };
    for (const auto& [name, text, said] : cases) {
        Live bench;
        bench.start(text);
        for (const Said& each : said) {
            bench.run(each.after_s);
            ASSERT_EQ(bench.status().outcome, JobOutcome::running) << name;
            bench.type(each.line);
        }
        ASSERT_TRUE(bench.finish_job()) << name;
        const twin::Report report = bench.report();
        EXPECT_TRUE(report.matches) << name << ": " << twin::to_json(report);
        EXPECT_NE(std::abs(report.findings.filament_asked_mm), 0) << name;
    }
}

TEST(LiveChanges, AFlowThatIsTypedInAPauseIsAskedForBehindIt) {
    Live bench;
    bench.start(lines(6, 5, 4));
    bench.command(link::Command::pause);
    ASSERT_TRUE(bench.run_until([&] { return bench.status().state == link::MachineState::paused; }, 30));
    bench.run(2);
    bench.type("M221 S180");
    bench.run(1);
    bench.command(link::Command::resume);
    ASSERT_TRUE(bench.finish_job());
    const twin::Report report = bench.report();
    EXPECT_TRUE(report.matches) << twin::to_json(report);
    EXPECT_GT(report.findings.filament_built_mm, 35) << "and not 24";
}

/// A printer in the simulator may be quicker than whoever tells the twin.
TEST(LiveChanges, TheTwinMayHearOfAFlowLate) {
    Live bench;
    bench.start(lines(60, 100, 0.4));
    bench.hold_typed();
    bench.type("M221 S150");
    bench.run(6);
    bench.tell_typed();
    ASSERT_TRUE(bench.finish_job());
    const twin::Report report = bench.report();
    EXPECT_TRUE(report.matches) << twin::to_json(report);
}

TEST(LiveChanges, AFlowThatTheTwinIsNotToldOfIsADifference) {
    Live bench;
    bench.start(lines(60, 100, 0.4));
    bench.hold_typed();
    bench.type("M221 S110");
    ASSERT_TRUE(bench.finish_job());
    EXPECT_FALSE(bench.report().matches);
}

TEST(LiveChanges, APauseNeedNotWaitForTheEndOfALine) {
    Live bench;
    bench.start(lines(4, 5, 1));
    bench.command(link::Command::pause);
    const double left_at = bench.metal().position_mm[0];
    ASSERT_TRUE(bench.run_until([&] { return bench.status().state == link::MachineState::paused; }, 30));
    bench.command(link::Command::resume);
    ASSERT_TRUE(bench.run_until([&] { return bench.status().excursions == 1; }, 30));
    EXPECT_LT(bench.metal().position_mm[0] - left_at, 5 * kAtOnce_s + 1);
    bench.run(3);
    bench.command(link::Command::pause);
    bench.run(5);
    bench.command(link::Command::resume);
    ASSERT_TRUE(bench.finish_job());
    EXPECT_EQ(bench.status().outcome, JobOutcome::completed) << bench.fault();
    const twin::Report report = bench.report();
    EXPECT_TRUE(report.matches) << (report.differences.empty() ? "" : report.differences[0]);
}

TEST(LiveChanges, ACancelNeedNotWaitForTheEndOfALine) {
    Live bench;
    bench.start(lines(4, 1, 0));
    bench.command(link::Command::cancel);
    ASSERT_TRUE(bench.run_until([&] { return bench.status().outcome == JobOutcome::cancelled; }, 15));
}

TEST(LiveChanges, AnObjectIsLeftOutFromTheNextLinesOn) {
    std::string text = "G28\nG1 X10 Y10 Z1 F6000\nM83\n";
    for (int layer = 0; layer < 20; ++layer) {
        const std::string z = "G1 Z" + std::to_string(1 + 0.3 * layer) + " F300\n";
        text += z +
                "EXCLUDE_OBJECT_START NAME=a\nG1 X40 Y10 F6000\nG1 X50 E1 F600\nEXCLUDE_OBJECT_END NAME=a\n"
                "EXCLUDE_OBJECT_START NAME=b\nG1 X80 Y10 F6000\nG1 X90 E1 F600\nEXCLUDE_OBJECT_END NAME=b\n";
    }
    Live bench;
    bench.start(text);  // in the first layers
    bench.type("EXCLUDE_OBJECT NAME=a");
    ASSERT_TRUE(bench.finish_job());
    const twin::Report report = bench.report();
    EXPECT_TRUE(report.matches) << (report.differences.empty() ? "" : report.differences[0]);
    EXPECT_LT(report.findings.filament_built_pushed_mm, 20 + 5);
    EXPECT_GE(report.findings.filament_built_pushed_mm, 20 + 1);
}

TEST(LiveChanges, ThePositionThatIsToldIsTheOneThatIsPlayed) {
    Live bench;
    bench.start(lines(10, 20) + "G1 Z20 F300\n");
    for (int i = 0; i < 40; ++i) {
        bench.run(0.25);
        const auto told = bench.status().position_mm;
        const auto true_mm = bench.metal().position_mm;
        for (std::size_t axis = 0; axis < 3; ++axis)
            ASSERT_NEAR(told[axis], true_mm[axis], 3.1) << "0.15 s at 20 mm/s, axis " << axis;
    }
    ASSERT_TRUE(bench.finish_job());
    bench.run(1);
    EXPECT_EQ(bench.status().position_mm[2], 20);
    EXPECT_EQ(bench.status().position_mm[0], 10);
    bench.type("G92 X50");
    bench.type("G1 X60 F60");
    bench.run(3);
    bench.type("M114");
    bench.run(0.3);
    const std::size_t at = bench.replies().rfind("X:5");
    ASSERT_NE(at, std::string::npos) << bench.replies();
    EXPECT_NEAR(std::stod(bench.replies().substr(at + 2)), 52.5, 1) << "as the program counts it";
}

/// Nothing may run dry while so little is ahead.
TEST(LiveChanges, DenseLinesAtFullSpeedNeverRunDry) {
    std::string text = "G28\nG1 X75 Y75 Z1 F6000\n";
    for (int i = 0; i < 40'000; ++i) {
        const double angle = 0.002 * i;
        text += "G1 X" + std::to_string(75 + 40 * std::cos(angle)) + " Y" +
                std::to_string(75 + 40 * std::sin(angle)) + " F6000\n";
    }
    Live bench;
    ASSERT_TRUE(bench.begin());
    bench.job(text);
    ASSERT_TRUE(bench.finish_job());
    EXPECT_EQ(bench.status().outcome, JobOutcome::completed) << bench.fault();
    EXPECT_EQ(bench.motion().starved, 0u);
    // 3200 mm at 100 mm/s, and what homing takes.
    EXPECT_LT(bench.status().print_time_s, 32 + 20);
}

}  // namespace
}  // namespace qduino::tests::live_test
