// However a job ends, it leaves the part and no heat; the twin judges the part alone.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "printer/estimate/estimator.h"
#include "printer/preflight/preflight.h"
#include "tests/scenario/printer/printer_bench.h"

namespace qduino::tests::ending_test {
namespace {

using link::JobOutcome;

/// Printed to its last line, and nothing behind it.
const std::string kWithoutEnd =
    "G28\nM83\nM140 S40\nM109 S200\nG1 X60 Y60 Z0.3 F6000\nG1 X80 E1 F1200\nG1 Y80 E1\nG1 X60 E1\nG1 Y60 "
    "E1\n";

double estimate_of(const std::string& text) {
    const auto preflight = std::make_unique<printer::preflight::Preflight>(printer::MachineConfig{});
    const auto estimator = std::make_unique<printer::estimate::Estimator>(printer::MachineConfig{});
    preflight->add_sink(*estimator);
    preflight->feed(text);
    static_cast<void>(preflight->finish());
    return estimator->estimate().total_s;
}

void expect_left(PrinterBench& bench) {
    bench.run(1);
    EXPECT_EQ(bench.heat().hot_end.target_celsius, 0);
    EXPECT_EQ(bench.heat().bed.target_celsius, 0);
    EXPECT_EQ(bench.heat().fan_duty, 0);
    const auto at = bench.metal().position_mm;
    EXPECT_NEAR(at[0], 0, 0.02);
    EXPECT_NEAR(at[1], 150, 0.02);
    EXPECT_GT(at[2], 5);
    EXPECT_NEAR(bench.status().position_mm[2], at[2], 0.01);
    EXPECT_TRUE(bench.status().homed[0] && bench.status().homed[1] && bench.status().homed[2]);
}

TEST(Ending, AJobWithoutAnEndCodeLeavesThePartAndMatches) {
    PrinterBench bench;
    ASSERT_TRUE(bench.begin());
    bench.job(kWithoutEnd + "M106 S255\n");
    ASSERT_TRUE(bench.finish_job());
    EXPECT_EQ(bench.status().outcome, JobOutcome::completed) << bench.fault();
    EXPECT_NEAR(bench.status().print_time_s, estimate_of(kWithoutEnd), 0.01 * bench.status().print_time_s);
    expect_left(bench);
    const twin::Report report = bench.report();
    EXPECT_TRUE(report.matches) << (report.differences.empty() ? "" : report.differences[0]);
    EXPECT_EQ(report.findings.excursions, 1u);
    // And the next one prints.
    bench.job(kWithoutEnd, 2);
    ASSERT_TRUE(bench.run_until([&] { return bench.status().job_id == 2; }, 10));
    ASSERT_TRUE(bench.finish_job());
    EXPECT_EQ(bench.status().outcome, JobOutcome::completed) << bench.fault();
}

TEST(Ending, BesideThePartTheHeadIsTooLowAsWell) {
    // A file that was cut off in a travel: whatever moves the head next may go through the part.
    PrinterBench bench;
    ASSERT_TRUE(bench.begin());
    bench.job(kWithoutEnd + "G1 X6 F6000\n");
    ASSERT_TRUE(bench.finish_job());
    EXPECT_EQ(bench.status().outcome, JobOutcome::completed) << bench.fault();
    expect_left(bench);
    EXPECT_TRUE(bench.report().matches);
}

/// One object after the other: the first is higher than the way up from the second.
const std::string kBesideATallOne =
    "G28\nM83\nM109 S200\nG1 X20 Y140 Z12 F6000\nG1 X30 E1 F1200\nG1 Z15 F600\nG1 X60 Y60 F6000\nG1 Z0.3 "
    "F600\n";

/// Runs until `done`; the head goes sideways only at Z `low_mm`, or over the tall object.
template <typename Done>
void expect_over_the_tall_one(PrinterBench& bench, double low_mm, Done done) {
    auto before = bench.metal().position_mm;
    const auto looked = [&] {
        const auto at = bench.metal().position_mm;
        const bool sideways = std::hypot(at[0] - before[0], at[1] - before[1]) > 0.02;
        const bool low = at[2] > low_mm + 0.01 && std::max(at[2], before[2]) < 13 - 0.01;
        if (sideways && low) {
            ADD_FAILURE() << "X " << at[0] << " Y " << at[1] << " at Z " << at[2];
            return true;
        }
        before = at;
        return done();
    };
    ASSERT_TRUE(bench.run_until(looked, 120));
}

TEST(Ending, TheWayOutGoesOverWhatStandsHigher) {
    PrinterBench bench;
    ASSERT_TRUE(bench.begin());
    bench.job(kBesideATallOne + "G1 X80 E1 F1200\n");
    ASSERT_TRUE(bench.run_until([&] { return bench.metal().position_mm[0] > 70; }, 600));
    expect_over_the_tall_one(bench, 0.3, [&] { return bench.status().outcome != JobOutcome::running; });
    EXPECT_NEAR(bench.metal().position_mm[2], 13, 0.01);
    EXPECT_NEAR(bench.status().print_time_s, estimate_of(kBesideATallOne + "G1 X80 E1 F1200\n"),
                0.01 * bench.status().print_time_s);
    EXPECT_TRUE(bench.report().matches);
}

TEST(Ending, SoDoesAPauseAndItsWayBack) {
    PrinterBench bench;
    ASSERT_TRUE(bench.begin());
    bench.job(kBesideATallOne + "G1 X80 E1 F600\nG1 X60 E1\nG1 Z20 F600\n");
    ASSERT_TRUE(bench.run_until(
        [&] { return bench.metal().position_mm[2] < 0.31 && bench.metal().position_mm[0] > 65; }, 600));
    bench.command(link::Command::pause);
    expect_over_the_tall_one(bench, 0.3, [&] { return bench.status().state == link::MachineState::paused; });
    EXPECT_NEAR(bench.metal().position_mm[2], 13, 0.01);
    bench.command(link::Command::resume);
    expect_over_the_tall_one(bench, 0.3, [&] { return bench.status().excursions == 1; });
    ASSERT_TRUE(bench.finish_job());
    EXPECT_EQ(bench.status().outcome, JobOutcome::completed) << bench.fault();
    EXPECT_TRUE(bench.report().matches);
}

TEST(Ending, WithItsMotorsOffTheHeadStaysWhereItIs) {
    PrinterBench bench;
    ASSERT_TRUE(bench.begin());
    const std::string text = kWithoutEnd + "M84\n";
    bench.job(text);
    ASSERT_TRUE(bench.finish_job());
    EXPECT_EQ(bench.status().outcome, JobOutcome::completed) << bench.fault();
    EXPECT_NEAR(bench.metal().position_mm[2], 0.3, 0.01) << "nobody knows where it is";
    EXPECT_EQ(bench.heat().hot_end.target_celsius, 0);
    EXPECT_NEAR(bench.status().print_time_s, estimate_of(text), 0.005 * bench.status().print_time_s);
    bench.job("G28\nM18 E\n" + kWithoutEnd, 2);
    ASSERT_TRUE(bench.run_until([&] { return bench.status().job_id == 2; }, 10));
    ASSERT_TRUE(bench.finish_job());
    expect_left(bench);
}

TEST(Ending, AnEndCodeThatLeavesThePartIsEnough) {
    PrinterBench bench;
    ASSERT_TRUE(bench.begin());
    bench.job(kWithoutEnd + "G1 Z10 F300\n");
    ASSERT_TRUE(bench.finish_job());
    EXPECT_NEAR(bench.metal().position_mm[0], 60, 0.02);
    EXPECT_EQ(bench.heat().hot_end.target_celsius, 0) << "no heat is left either way";
    EXPECT_TRUE(bench.report().matches);
    EXPECT_EQ(bench.status().excursions, 0u);
}

/// A job that is cancelled in the part.
void cancel_in_the_part(PrinterBench& bench) {
    ASSERT_TRUE(bench.begin());
    std::string text = kWithoutEnd;
    for (int i = 0; i < 20; ++i) text += i % 2 == 0 ? "G1 X80 E1 F600\n" : "G1 X60 E1\n";
    bench.job(text);
    ASSERT_TRUE(bench.run_until([&] { return bench.metal().position_mm[3] > 5; }, 600));
    bench.command(link::Command::cancel);
}

TEST(Ending, ACancelledJobLeavesThePart) {
    PrinterBench bench;
    ASSERT_NO_FATAL_FAILURE(cancel_in_the_part(bench));
    ASSERT_TRUE(bench.finish_job(60));
    EXPECT_EQ(bench.status().outcome, JobOutcome::cancelled);
    expect_left(bench);
}

/// Heat is off from the last move on: what is left in the nozzle would ooze on the part, and the
/// way out takes seconds. Runs until the job is over, and looks all along the way.
void expect_cold_way_out(PrinterBench& bench, double part_z_mm) {
    int looks = 0;
    const auto is_over = [&] {
        if (bench.metal().position_mm[2] > part_z_mm + 0.1) {
            ++looks;
            EXPECT_EQ(bench.heat().hot_end.target_celsius, 0) << "Z " << bench.metal().position_mm[2];
            EXPECT_EQ(bench.heat().bed.target_celsius, 0);
            EXPECT_EQ(bench.heat().hot_end.duty, 0);
        }
        return bench.status().outcome != JobOutcome::running;
    };
    ASSERT_TRUE(bench.run_until(is_over, 60));
    EXPECT_GT(looks, 5) << "the way out was not seen";
    // And it stays so: the pins of both heaters are low.
    bench.run(2);
    EXPECT_EQ(bench.metal().heater_duty[0], 0);
    EXPECT_EQ(bench.metal().heater_duty[1], 0);
}

TEST(Ending, TheWayOutOfThePartIsColdAlready) {
    PrinterBench bench;
    ASSERT_TRUE(bench.begin());
    bench.job(kWithoutEnd);
    ASSERT_TRUE(bench.run_until([&] { return bench.metal().position_mm[3] > 3; }, 600));
    ASSERT_GT(bench.heat().hot_end.target_celsius, 0);
    expect_cold_way_out(bench, 0.3);
    EXPECT_EQ(bench.status().outcome, JobOutcome::completed) << bench.fault();
}

TEST(Ending, TheWayOutOfACancelledPartIsColdAlready) {
    PrinterBench bench;
    ASSERT_NO_FATAL_FAILURE(cancel_in_the_part(bench));
    // Typed behind it, as by a host that polls: a job that is over takes no heat from anybody.
    bench.type("M104 S200");
    expect_cold_way_out(bench, 0.3);
    EXPECT_EQ(bench.status().outcome, JobOutcome::cancelled);
}

TEST(Ending, ALineThatFailsInThePartLeavesIt) {
    PrinterBench bench;
    ASSERT_TRUE(bench.begin());
    bench.job(kWithoutEnd + "G1 X9000\n");
    ASSERT_TRUE(bench.finish_job());
    EXPECT_EQ(bench.status().outcome, JobOutcome::failed);
    expect_left(bench);
}

TEST(Ending, AHeadThatWandersWithoutAWordIsADifference) {
    PrinterBench bench;
    ASSERT_TRUE(bench.begin());
    bench.job(kWithoutEnd + "G1 Z10 F300\n");
    ASSERT_TRUE(bench.finish_job());
    bench.type("G1 X30 Y30 F6000");  // nobody has told the twin of it
    bench.run(5);
    EXPECT_FALSE(bench.report().matches);
}

TEST(Ending, APauseIsNotTakenOnTheWayOut) {
    PrinterBench bench;
    ASSERT_TRUE(bench.begin());
    bench.job(kWithoutEnd);
    ASSERT_TRUE(bench.run_until(
        [&] {
            return bench.status().bytes_executed == kWithoutEnd.size() && bench.metal().position_mm[2] > 1;
        },
        600));
    bench.command(link::Command::pause);
    ASSERT_TRUE(bench.finish_job(60));
    EXPECT_EQ(bench.status().outcome, JobOutcome::completed);
    EXPECT_NE(bench.replies().find("pause was not taken: the job is over"), std::string::npos);
}

}  // namespace
}  // namespace qduino::tests::ending_test
