// What slicers write before the first layer, on the whole printer: what preflight accepts is not
// heated and then failed.
#include <gtest/gtest.h>

#include "printer/preflight/preflight.h"
#include "tests/scenario/printer/printer_bench.h"

namespace qduino::tests::start_code_test {
namespace {

using link::JobOutcome;

bool preflight_accepts(const std::string& text) {
    const auto preflight = std::make_unique<printer::preflight::Preflight>(printer::MachineConfig{});
    preflight->feed(text);
    return preflight->finish().accepted();
}

/// A little part, and an end code.
const std::string kPart = "G1 X60 Y30 Z0.3 F3000\nG1 X70 E1 F1200\nM104 S0\nG1 Z20 F300\nM84\n";

void expect_printed(const std::string& text) {
    EXPECT_TRUE(preflight_accepts(text)) << text;
    PrinterBench bench;
    ASSERT_TRUE(bench.begin());
    bench.job(text);
    ASSERT_TRUE(bench.finish_job(1200));
    EXPECT_EQ(bench.status().outcome, JobOutcome::completed) << bench.fault();
    const twin::Report report = bench.report();
    EXPECT_TRUE(report.matches) << (report.differences.empty() ? "" : report.differences[0]);
    EXPECT_EQ(report.cold_extrusion_steps, 0u);
}

// PrusaSlicer's for the MK4S cleans a nozzle at the least temperature, draws back, and heats on.
TEST(StartCode, AWaitForTheLimitItselfIsWarmEnough) {
    expect_printed(
        "M104 S170\nM109 R170\nG28\nG90\nM83\nG1 X42 Y4 Z5 F4800\nG1 E-2 F2400\nM109 S205\nG1 E2\n" + kPart);
}

TEST(StartCode, M302LetsFilamentMoveAsFarBelowAsTheFloor) {
    expect_printed("M109 R162\nG28\nM83\nG1 Z5 F300\nM302 S160\nG1 E-2 F2400\nM109 S205\nG1 E2\n" + kPart);
}

TEST(StartCode, AtTheLimitFilamentFlowsWithTheFanOn) {
    std::string text = "G28\nM83\nM109 S170\nM106 S255\nG1 X20 Y20 Z1 F3000\n";
    for (int i = 0; i < 40; ++i) text += i % 2 == 0 ? "G1 X120 E5 F3600\n" : "G1 X20 E5\n";
    expect_printed(text + "M104 S0\nG1 Z20 F300\n");
}

TEST(StartCode, AWaitThatCoolsTooFarIsRefusedBeforeTheHeat) {
    EXPECT_FALSE(preflight_accepts("G28\nM83\nM109 S205\nM109 R160\nG1 E-2 F2400\n"));
}

}  // namespace
}  // namespace qduino::tests::start_code_test
