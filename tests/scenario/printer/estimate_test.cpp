// The estimate against the print: the sketch, the simulated board and the twin do the job, and
// take as long as was said.
#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "config/machine_file.h"
#include "printer/estimate/estimator.h"
#include "printer/preflight/preflight.h"
#include "tests/scenario/printer/printer_bench.h"

namespace qduino::tests::estimate_test {
namespace {

constexpr double kAsked = 0.005;
/// Loop 1 hears of an order's end at a release, by counts that are up to 10 ms old: a job of
/// seconds may end one release later.
constexpr double kOneRelease_s = 0.1;

printer::estimate::Estimate estimate_of(std::string_view job, const printer::MachineConfig& machine) {
    const auto estimator = std::make_unique<printer::estimate::Estimator>(machine);
    printer::preflight::Preflight preflight{machine};
    preflight.add_sink(*estimator);
    preflight.feed({job.data(), job.size()});
    EXPECT_TRUE(preflight.finish().accepted());
    return estimator->estimate();
}

struct Took {
    double print_s = 0, heating_s = 0;
};
Took printed(const std::string& job, const printer::MachineConfig& machine, const twin::Machine& metal) {
    PrinterBench bench{machine, metal};
    EXPECT_TRUE(bench.begin());
    bench.job(job);
    EXPECT_TRUE(bench.finish_job(5000)) << bench.fault();
    EXPECT_EQ(bench.status().outcome, link::JobOutcome::completed) << bench.fault();
    return {bench.status().print_time_s, bench.status().heating_time_s};
}

/// Prints it, and compares.
void expect_as_estimated(const std::string& job, const printer::MachineConfig& machine = {}) {
    const printer::estimate::Estimate estimate = estimate_of(job, machine);
    const Took took = printed(job, machine, apps::twin_machine(machine));
    EXPECT_NEAR(estimate.total_s, took.print_s, std::max(kAsked * took.print_s, kOneRelease_s + 1e-6))
        << "estimated " << estimate.total_s << " s, printed " << took.print_s << " s";
    EXPECT_NEAR(estimate.heating_s(), took.heating_s, 0.5);
}

printer::MachineConfig machine_of(std::string_view file) {
    const auto parsed = apps::parse_machine(file, "machine.toml");
    EXPECT_TRUE(parsed) << parsed.error().message.view();
    return *parsed;
}

std::string delta(std::string_view more = {}) {
    std::string file =
        "[kinematics]\ntype = \"delta\"\ndelta_radius_mm = 250\narm_length_mm = 560\nbed_radius_mm = 215\n"
        "endstop_offset_y_mm = 0.4\n";
    for (const char* axis : {"x", "y", "z"})
        write(file, "[axes.", axis, "]\nsteps_per_mm = 100\nmax_speed_mm_s = 200\n",
              "max_acceleration_mm_s2 = 3000\n");
    return file.append("maximum_mm = 300\nhome_speed_mm_s = 60\nhome_retreat_mm = 4\n").append(more);
}

/// A round tower: walls of short segments, infill, retractions, hops.
std::string tower(int layers) {
    std::string job = "M83\n";
    for (int layer = 0; layer < layers; ++layer) {
        job += text<std::string>(";LAYER_CHANGE\nG1 Z", Fixed{0.2 + 0.2 * layer, 1},
                                 " F300\nG1 X85 Y75 F7200\nG1 F1800\n");
        for (int side = 1; side <= 72; ++side) {
            const double angle = side * 2 * std::numbers::pi / 72;
            job += text<std::string>("G1 X", Fixed{75 + 10 * std::cos(angle), 3}, " Y",
                                     Fixed{75 + 10 * std::sin(angle), 3}, " E0.029\n");
        }
        job += "G1 E-0.8 F2400\nG1 X60 Y60 F7800\nG1 E0.8 F2400\nG1 F3600\n";
        for (int line = 0; line < 20; ++line)
            job += text<std::string>("G1 X", line / 2 % 2 == 0 ? 60 : 90, " Y", Fixed{60 + 0.7 * line, 1},
                                     " E0.3\n");
    }
    return job;
}

TEST(EstimateOfAPrint, AColdStartWithBedAndHotEndIsMet) {
    expect_as_estimated("M140 S60\nM104 S150\nG28\nM190 S60\nM109 S210\n" + tower(8) +
                        "M104 S0\nM140 S0\nG28 X\nM84\n");
}

TEST(EstimateOfAPrint, MotionAloneIsMet) {
    // Long beside heat and homing, so that the motion decides.
    expect_as_estimated("M104 S200\nG28\nM109 S200\nM204 P600 T600\n" + tower(30) + "M205 X5\n" + tower(6));
}

TEST(EstimateOfAPrint, DwellsAndHomingFromAKnownPlaceAreMet) {
    // Nothing moves before the first two dwells.
    std::string job = "G28\nG4 S20\nG28 X Y\nG4 S20\nG1 X5 F6000\n";
    for (int i = 0; i < 12; ++i) job += "G1 X120 Y100 Z12 F6000\nG4 S3\nG4 P0\nG28\nM400\n";
    expect_as_estimated(job);
}

TEST(EstimateOfAPrint, TemperaturesThatChangeOnTheWayAreMet) {
    std::string job = "G28\nM109 S190\n";
    for (int celsius = 195; celsius <= 230; celsius += 5)
        job += text<std::string>("M109 S", celsius, "\n") + tower(1);
    expect_as_estimated(job + "M109 R180\n" + tower(1));
}

TEST(EstimateOfAPrint, MovesSoShortThatTheQueueBoundsTheirSpeedAreMet) {
    // Half of the queue's places are markers: what can brake is 248 moves, at 70 mm/s and not 100.
    std::string job = "G28\nG1 Z0.3 F300\nG1 X20 Y20 F6000\nG1 F7500\n";
    for (int i = 1; i <= 40'000; ++i)
        job += text<std::string>("G1 X", Fixed{120 - 0.005 * std::abs(20'000 - i), 3}, "\n");
    expect_as_estimated(job + "G4 S15\nM84\n");
}

/// Half a minute: three tenths of a second are one in a hundred.
const std::string kShortJob = [] {
    std::string job = "G28\nG1 Z0.3 F300\nG1 X20 Y20 F6000\n";
    for (int i = 1; i <= 8000; ++i) write(job, "G1 X", Fixed{20 + 0.005 * i, 3}, " F7500\n");
    return job + "M84\n";
}();

TEST(EstimateOfAPrint, AShortJobIsMetOnEveryKinematics) {
    for (const std::string& file :
         {std::string{}, std::string{"[kinematics]\ntype = \"corexy\"\n"}, delta(),
          std::string{"[axes.x]\nexpected_from_switch_mm = 140\n[axes.y]\nhome_towards_minimum = false\n"
                      "home_position_mm = 150\nexpected_from_switch_mm = 3\n"},
          delta("expected_from_switch_mm = 200\n")}) {
        SCOPED_TRACE(file);
        expect_as_estimated(kShortJob, machine_of(file));
    }
}

TEST(EstimateOfAPrint, WhereTheAxesStoodIsAllThatIsOpen) {
    const printer::MachineConfig expected = machine_of(delta());
    const printer::estimate::Estimate estimate = estimate_of(kShortJob, expected);
    EXPECT_GT(estimate.less_s, 0.5);
    EXPECT_GT(estimate.more_s, 4);
    for (const double from_switch_mm : {1.0, 90.0, 250.0}) {
        SCOPED_TRACE(from_switch_mm);
        printer::MachineConfig moved = expected;
        moved.axes[printer::Axis::z].expected_from_switch = Millimetres{from_switch_mm};
        const Took took = printed(kShortJob, expected, apps::twin_machine(moved));
        EXPECT_GT(took.print_s, estimate.total_s - estimate.less_s - kOneRelease_s);
        EXPECT_LT(took.print_s, estimate.total_s + estimate.more_s + kOneRelease_s);
        EXPECT_NEAR(took.print_s / estimate_of(kShortJob, moved).total_s, 1, kAsked);
    }
    // On its place once, nothing is open any more.
    EXPECT_EQ(estimate_of(kShortJob + "G28\n", expected).more_s, estimate.more_s);
}

TEST(EstimateOfAPrint, FiltersThatRunOutAreMet) {
    printer::MachineConfig machine;
    for (const printer::Axis axis : {printer::Axis::x, printer::Axis::y})
        machine.axes[axis].shaper = {.type = printer::ShaperType::two_hump_ei, .frequency_hz = 30};
    std::string job = "G28\n";
    for (int i = 0; i < 40; ++i) job += "G1 X40 Y30 F6000\nG4 P10\nG1 X20 Y20\nG4 P10\nG28 X\n";
    expect_as_estimated(job + "M84\n", machine);
}

TEST(EstimateOfAPrint, AnotherMachinesHeatersAreMet) {
    printer::MachineConfig machine;
    machine.bed.model = {.power_w = 220, .heat_capacity_j_k = 1200, .loss_w_k = 1.4, .sensor_lag_s = 8};
    machine.hot_end.model.power_w = 60;
    machine.room = Celsius{28};
    expect_as_estimated("M190 S80\nG28\nM109 S240\n" + tower(3), machine);
}

}  // namespace
}  // namespace qduino::tests::estimate_test
