// Heat as a printer needs it: quick, without overshoot, and held while filament flows and the fan
// blows. The twin's heaters are not the printer's model, and judge. Times are virtual.
#include <gtest/gtest.h>

#include "tests/scenario/printer/printer_bench.h"
#include "tests/unit/heat/naive_heater.h"

namespace qduino::tests::heat_test {
namespace {

using link::JobOutcome;

/// The twin's own numbers (twin/machine.h), in small steps.
NaiveHeater naive(const twin::HeaterSpec& spec) {
    NaiveHeater heater;
    heater.power_w = spec.power_w;
    heater.heat_capacity_j_k = spec.heat_capacity_j_k;
    heater.loss_w_k = spec.loss_w_k;
    heater.sensor_lag_s = spec.sensor_lag_s;
    return heater;
}

/// A machine that is what its file says in nothing but its wiring.
twin::Machine other_metal() {
    twin::Machine metal;
    twin::HeaterSpec& hot_end = metal.heaters[twin::kHotEnd];
    hot_end.power_w = 58;
    hot_end.heat_capacity_j_k = 14;
    hot_end.loss_w_k = 0.13;
    hot_end.fan_loss_share = 0.4;
    hot_end.sensor_lag_s = 1.6;
    twin::HeaterSpec& bed = metal.heaters[twin::kBed];
    bed.power_w = 240;
    bed.heat_capacity_j_k = 900;
    bed.loss_w_k = 1.5;
    bed.sensor_lag_s = 9;
    return metal;
}

struct HeatUp {
    double waited_s = 0;
    double highest = 0;  // the sensor, until 200 s later
    double last = 0;     // then
};

/// `code` (M109 S205) from cold, as a job.
HeatUp heat_up(PrinterBench& bench, const std::string& code, int heater) {
    const Instant begun = bench.now();
    HeatUp result;
    const auto look = [&] { result.highest = std::max(result.highest, bench.metal().celsius[heater]); };
    // A job that is over leaves no heat: it ends with a wait.
    bench.job(code + "\nM117 warm\nG4 S300\n");
    const auto over = [&] {
        look();
        return bench.status().message.view() == "warm";
    };
    EXPECT_TRUE(bench.run_until(over, 3000));
    EXPECT_EQ(bench.fault(), "");
    result.waited_s = to_seconds(bench.now() - begun);
    const Instant later = bench.now() + 200s;
    EXPECT_TRUE(bench.run_until(
        [&] {
            look();
            return bench.now() >= later;
        },
        300));
    result.last = bench.metal().celsius[heater];
    return result;
}

void expect_quick_and_level(PrinterBench& bench, const std::string& code, int heater, double target) {
    const double full_power_s = naive(bench.twin().machine().heaters[heater]).full_power_time_s(target);
    const HeatUp seen = heat_up(bench, code, heater);
    std::printf("%-10s full power %6.1f s, waited %6.1f s (%.3f), overshoot %+.2f C\n", code.c_str(),
                full_power_s, seen.waited_s, seen.waited_s / full_power_s, seen.highest - target);
    EXPECT_LE(seen.waited_s, 1.1 * full_power_s);
    EXPECT_LE(seen.highest, target + 1);
    EXPECT_NEAR(seen.last, target, 0.5);
}

TEST(HeatUp, TheBedTo60) {
    PrinterBench bench(printer::MachineConfig{}, twin::Machine{});
    ASSERT_TRUE(bench.begin());
    expect_quick_and_level(bench, "M190 S60", twin::kBed, 60);
}

TEST(HeatUp, TheHotEndTo205) {
    PrinterBench bench(printer::MachineConfig{}, twin::Machine{});
    ASSERT_TRUE(bench.begin());
    expect_quick_and_level(bench, "M109 S205", twin::kHotEnd, 205);
}

/// G-code that melts 12 mm³/s for `seconds`: lines of 100 mm at 60 mm/s.
std::string at_12_mm3_s(double seconds) {
    const double filament_mm = 12 * (100.0 / 60) / 2.405282;
    std::string text = "M83\n";
    for (int i = 0; i < seconds * 60 / 100; ++i)
        text +=
            "G1 X" + std::string(i % 2 == 0 ? "120" : "20") + " E" + std::to_string(filament_mm) + " F3600\n";
    return text;
}

TEST(HeatHold, TwelveCubicMillimetresPerSecondWithFullFan) {
    PrinterBench bench(printer::MachineConfig{}, twin::Machine{});
    ASSERT_TRUE(bench.begin());
    bench.job("G28\nM109 S205\nG1 X20 Y20 Z1 F3000\nG4 S60\nM106 S255\n" + at_12_mm3_s(90) +
              "M107\nG4 S60\nG1 Z20 F300\n");
    ASSERT_TRUE(bench.run_until([&] { return bench.heat().fan_duty > 0; }, 600));
    double lowest = 1e9, highest = 0, block_lowest = 1e9, block_highest = 0;
    while (bench.status().outcome == JobOutcome::running) {
        bench.run(0.05);
        const twin::PrinterState metal = bench.metal();
        lowest = std::min(lowest, metal.celsius[twin::kHotEnd]);
        highest = std::max(highest, metal.celsius[twin::kHotEnd]);
        block_lowest = std::min(block_lowest, metal.block_celsius[twin::kHotEnd]);
        block_highest = std::max(block_highest, metal.block_celsius[twin::kHotEnd]);
    }
    std::printf("12 mm3/s, full fan: sensor %+.2f %+.2f C, block %+.2f %+.2f C\n", lowest - 205,
                highest - 205, block_lowest - 205, block_highest - 205);
    EXPECT_EQ(bench.status().outcome, JobOutcome::completed) << bench.fault();
    EXPECT_GT(lowest, 204);
    EXPECT_LT(highest, 206);
    EXPECT_GT(block_lowest, 204);
    EXPECT_LT(block_highest, 206);
}

TEST(HeatHold, WithAFanThatDoesNotTurn) {
    PrinterBench bench(printer::MachineConfig{}, twin::Machine{});
    ASSERT_TRUE(bench.begin());
    bench.twin().inject(*twin::parse_fault("fan_dead"));
    bench.job("G28\nM109 S205\nG4 S60\nM106 S255\nG4 S120\n");
    ASSERT_TRUE(bench.run_until([&] { return bench.heat().fan_duty > 0; }, 600));
    double highest = 0;
    while (bench.status().outcome == JobOutcome::running) {
        bench.run(0.05);
        highest = std::max(highest, bench.metal().celsius[twin::kHotEnd]);
    }
    EXPECT_EQ(bench.status().outcome, JobOutcome::completed) << bench.fault();
    EXPECT_LT(highest, 206.5);
}

/// Tunes both heaters of `metal` and keeps what was found.
link::KeptHeat tuned_on(const twin::Machine& metal, const std::string& codes) {
    PrinterBench bench(printer::MachineConfig{}, metal);
    EXPECT_TRUE(bench.begin());
    bench.job(codes);
    EXPECT_TRUE(bench.finish_job(20'000));
    EXPECT_EQ(bench.status().outcome, JobOutcome::completed) << bench.fault();
    EXPECT_EQ(bench.metal().heater_duty[twin::kHotEnd], 0) << "off when it is over";
    EXPECT_EQ(bench.metal().heater_duty[twin::kBed], 0);
    return bench.printer().link().kept_heat.read();
}

TEST(Tuning, TheModelIsFoundOnAMachineThatIsNotTheFiles) {
    const twin::Machine metal = other_metal();
    // What is printed on the parts; the rest is found.
    const link::KeptHeat kept =
        tuned_on(metal, "M306 P58\nM306 T S200\nM306 E-1 P240\nM306 E-1 T S60\nM500\n");
    ASSERT_EQ(kept.number, 1u);
    EXPECT_NEAR(kept.hot_end.model.heat_capacity_j_k, 14, 0.5);
    EXPECT_NEAR(kept.hot_end.model.loss_w_k, 0.13, 0.004);
    EXPECT_NEAR(kept.hot_end.model.fan_loss_w_k, 0.052, 0.005);
    EXPECT_NEAR(kept.bed.model.heat_capacity_j_k, 900, 30);
    printer::MachineConfig config;
    apply(kept.hot_end, config.hot_end);
    apply(kept.bed, config.bed);
    for (const auto& [code, heater, target] :
         {std::tuple{"M109 S205", twin::kHotEnd, 205.0}, std::tuple{"M190 S60", twin::kBed, 60.0}}) {
        PrinterBench bench(config, metal);
        ASSERT_TRUE(bench.begin());
        expect_quick_and_level(bench, code, heater, target);
    }
}

TEST(Tuning, TheGainsAreFoundAndPutInForce) {
    printer::MachineConfig config;
    const link::KeptHeat kept =
        tuned_on(twin::Machine{}, "M303 E0 S205 C6 U1\nM303 E-1 S60 C5 U1\nM301\nM500\n");
    ASSERT_EQ(kept.number, 1u);
    EXPECT_NE(kept.hot_end.kp, config.hot_end.kp);
    EXPECT_NE(kept.bed.kp, config.bed.kp);
    apply(kept.hot_end, config.hot_end);
    apply(kept.bed, config.bed);
    config.hot_end.control = config.bed.control = printer::HeaterControl::pid;
    for (const auto& [code, heater, target] :
         {std::tuple{"M109 S205", twin::kHotEnd, 205.0}, std::tuple{"M190 S60", twin::kBed, 60.0}}) {
        PrinterBench bench(config, twin::Machine{});
        ASSERT_TRUE(bench.begin());
        expect_quick_and_level(bench, code, heater, target);
    }
}

TEST(Tuning, ACancelledOrFaultyExperimentLeavesTheHeatOff) {
    PrinterBench bench(printer::MachineConfig{}, twin::Machine{});
    ASSERT_TRUE(bench.begin());
    bench.type("M306 T");
    ASSERT_TRUE(bench.run_until([&] { return bench.heat().hot_end.celsius > 60; }, 120));
    bench.command(link::Command::cancel);
    bench.run(2);
    EXPECT_EQ(bench.metal().heater_duty[twin::kHotEnd], 0);
    EXPECT_EQ(bench.heat().hot_end.target_celsius, 0);
    bench.type("M306 T");
    bench.run(400);
    bench.twin().inject(*twin::parse_fault("sensor_open:hot_end"));
    bench.run(1);
    EXPECT_EQ(bench.status().state, link::MachineState::faulted);
    EXPECT_EQ(bench.metal().heater_duty[twin::kHotEnd], 0);
}

TEST(Settings, AreReportedChangedKeptAndRestored) {
    PrinterBench bench;
    ASSERT_TRUE(bench.begin());
    for (const char* line : {"M301", "M304", "M306", "M301 P30 I2", "M301", "M306 C18", "M306", "M500",
                             "M301 P1", "M501", "M301"})
        bench.type(line);
    bench.run(3);
    const std::string replies = bench.replies();
    EXPECT_NE(replies.find("M301 P22.20 I1.0800 D114.00"), std::string::npos) << replies;
    EXPECT_NE(replies.find("M304 P10.00 I0.0230 D305.40"), std::string::npos) << replies;
    EXPECT_NE(replies.find("M306 P40.00 C22.00 R0.4049 A0.0900 F0.1125 H0.0048"), std::string::npos)
        << replies;
    EXPECT_NE(replies.find("M306 P40.00 C18.00"), std::string::npos) << replies;
    EXPECT_EQ(replies.rfind("M301 P30.00 I2.0000 D114.00"), replies.rfind("M301 P")) << replies;
    const link::KeptHeat kept = bench.printer().link().kept_heat.read();
    EXPECT_EQ(kept.number, 1u);
    EXPECT_EQ(kept.hot_end.kp, 30);
    EXPECT_EQ(kept.hot_end.model.heat_capacity_j_k, 18);
    for (const char* line : {"M502", "M301", "M306"}) bench.type(line);
    bench.run(1);
    const std::string after = bench.replies().substr(replies.size());
    EXPECT_NE(after.find("M301 P22.20 I1.0800 D114.00"), std::string::npos) << "M502: the machine file's";
    EXPECT_NE(after.find("M306 P40.00 C22.00"), std::string::npos) << after;
    EXPECT_EQ(bench.printer().link().kept_heat.read().number, 1u) << "nothing is kept by it";
    bench.type("M501");
    bench.type("M301");
    bench.run(1);
    EXPECT_EQ(bench.replies().rfind("M301 P30.00"), bench.replies().rfind("M301 P")) << "M501: what was kept";
}

}  // namespace
}  // namespace qduino::tests::heat_test
