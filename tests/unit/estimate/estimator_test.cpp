// The estimate of small jobs whose times can be worked out by hand.
#include "printer/estimate/estimator.h"

#include <gtest/gtest.h>

#include <memory>
#include <numeric>
#include <string>

#include "printer/preflight/preflight.h"

namespace qduino::printer::estimate::estimator_test {
namespace {

Estimate estimate_of(std::string_view job, const MachineConfig& machine = {}) {
    const auto estimator = std::make_unique<Estimator>(machine);
    preflight::Preflight preflight{machine};
    preflight.add_sink(*estimator);
    preflight.feed({job.data(), job.size()});
    static_cast<void>(preflight.finish());
    return estimator->estimate();
}

double time_of(const Estimate& estimate, Activity activity) {
    return estimate.activity_s[static_cast<std::size_t>(activity)];
}

/// What a move from rest to rest takes.
double trapezoid_s(double length_mm, double speed_mm_s, double acceleration_mm_s2) {
    return length_mm / speed_mm_s + speed_mm_s / acceleration_mm_s2;
}

TEST(Estimator, AMoveIsItsTrapezoid) {
    const Estimate estimate = estimate_of("G1 X100 F6000\n");
    EXPECT_NEAR(time_of(estimate, Activity::travel), trapezoid_s(100, 100, 2000), 1e-9);
    EXPECT_NEAR(estimate.total_s, trapezoid_s(100, 100, 2000), 0.11) << "and up to one release";
}

TEST(Estimator, TheJobsOwnLimitsCount) {
    const Estimate slow = estimate_of("M204 P1000 T500\nG1 X100 F6000\n");
    EXPECT_NEAR(time_of(slow, Activity::travel), trapezoid_s(100, 100, 500), 1e-9);
    const Estimate limited = estimate_of("M203 X20\nM201 X100\nG1 X100 F6000\n");
    EXPECT_NEAR(time_of(limited, Activity::travel), trapezoid_s(100, 20, 100), 1e-9);
    const Estimate factor = estimate_of("M220 S50\nG1 X100 F6000\n");
    EXPECT_NEAR(time_of(factor, Activity::travel), trapezoid_s(100, 50, 2000), 1e-9);
}

TEST(Estimator, ADwellIsItsTime) {
    const Estimate estimate = estimate_of("G1 X10 F600\nG4 S7\nG4 P500\nG1 X20\n");
    EXPECT_NEAR(time_of(estimate, Activity::dwell), 7.5, 0.11);
    EXPECT_NEAR(time_of(estimate, Activity::travel), 2 * trapezoid_s(10, 10, 2000), 1e-9)
        << "at rest between";
}

TEST(Estimator, HomingIsWhatTheMachineMakes) {
    // From 100 mm: the way to the switch at full acceleration, which the switch cuts off; back,
    // and slowly again; a rest; one release between two orders.
    const Estimate once = estimate_of("G28 X\n");
    const Estimate twice = estimate_of("G28 X\nG1 X100 F6000\nG28 X\n");
    const double homing_s = time_of(twice, Activity::homing) - time_of(once, Activity::homing);
    const double approach_s = 100.0 / 40 + 0.5 * 40 / 2000;
    const double least_s = approach_s + trapezoid_s(3, 40, 2000) + 3.0 / 4 + 0.06;
    EXPECT_GT(homing_s, least_s + 3 * 0.1);
    EXPECT_LT(homing_s, least_s + 8 * 0.1);
    const Estimate other_axis = estimate_of("G28 Z\n");
    EXPECT_GT(time_of(other_axis, Activity::homing), 12.0 / 4 + 1.0 / 4 + 1.0 / 0.4)
        << "Z is expected 12 mm up";
}

TEST(Estimator, WaitsForHeatStandApart) {
    const Estimate cold = estimate_of("G28\nG1 X50 F3000\n");
    const Estimate hot = estimate_of("M109 S200\nG28\nG1 X50 F3000\n");
    EXPECT_GT(hot.heating_s(), 100);
    EXPECT_LT(hot.heating_s(), 200);
    EXPECT_NEAR(hot.total_s - hot.heating_s(), cold.total_s, 0.21);
    const Estimate early = estimate_of("M104 S200\nG28\nM109 S200\nG1 X50 F3000\n");
    EXPECT_LT(early.heating_s(), hot.heating_s() - 5) << "it heats up while it homes";
    EXPECT_EQ(estimate_of("M104 S200\nG1 X50 F3000\n").heating_s(), 0);
}

const std::string kTwoLayers =
    "G28\nM83\nM109 S200\n;LAYER_CHANGE\n;TYPE:External perimeter\nG1 Z0.2 F300\nG1 X10 Y10 F6000\n"
    "G1 X50 Y10 E2 F1200\nG1 E-1 F1500\n;LAYER_CHANGE\n;TYPE:Internal infill\nG1 Z0.4\nG1 E1\nG1 X10 Y50 E2 "
    "F1200\n";

TEST(Estimator, TheTimeIsDividedByWhatItGoesInto) {
    const Estimate estimate = estimate_of(kTwoLayers);
    EXPECT_NEAR(time_of(estimate, activity_of(gcode::Feature::outer_wall)), trapezoid_s(40, 20, 2000), 0.02);
    EXPECT_NEAR(time_of(estimate, activity_of(gcode::Feature::sparse_infill)), 56.57 / 20, 0.03);
    EXPECT_NEAR(time_of(estimate, Activity::retraction), 2 * 1 / 14.0, 0.01);
    EXPECT_NEAR(std::accumulate(estimate.activity_s.begin(), estimate.activity_s.end(), 0.0),
                estimate.total_s, 1e-9);
    ASSERT_EQ(estimate.layer_s.size(), 2u);
    EXPECT_NEAR(estimate.layer_s[1], 56.57 / 20, 0.2);
    EXPECT_EQ(name_of(Activity::heating), "heating");
    EXPECT_EQ(name_of(activity_of(gcode::Feature::custom)), "custom");
}

TEST(Estimator, HowTheFileIsCutDoesNotMatter) {
    const MachineConfig machine;
    const auto estimator = std::make_unique<Estimator>(machine);
    preflight::Preflight preflight{machine};
    preflight.add_sink(*estimator);
    for (const char& byte : kTwoLayers) preflight.feed({&byte, 1});
    static_cast<void>(preflight.finish());
    EXPECT_EQ(estimator->estimate().total_s, estimate_of(kTwoLayers).total_s);
}

TEST(Estimator, APauseTakesNoTimeButBringsToRest) {
    const Estimate through = estimate_of("G1 X50 F3000\nG1 X100\n");
    const Estimate paused = estimate_of("G1 X50 F3000\nM0\nG1 X100\n");
    EXPECT_NEAR(time_of(paused, Activity::travel) - time_of(through, Activity::travel), 50.0 / 2000, 1e-9);
}

}  // namespace
}  // namespace qduino::printer::estimate::estimator_test
