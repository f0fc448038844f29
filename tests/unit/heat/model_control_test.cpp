// Model-based control on heaters that are not the model: every number up to 20 % wrong.
#include "printer/heat/model_control.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "tests/unit/heat/naive_heater.h"

namespace qduino::printer::heat::model_control_test {
namespace {

using tests::NaiveHeater;

struct Bench {
    explicit Bench(const HeaterModel& believed) : control(believed) {}

    NaiveHeater heater;
    ModelControl control;
    double duty = 0, fan = 0, flow = 0, target = 0;
    double highest = 0, lowest = 1e9;
    double elapsed_s = 0;

    void run(double seconds) {
        for (int i = 0; i < static_cast<int>(seconds / 0.008); ++i) {
            duty = control.update({heater.reading(), target, duty, 0.008, fan, flow, heater.room_celsius});
            heater.advance(duty, fan, flow, 0.008, 0.004);
            highest = std::max(highest, heater.sensor_celsius);
            lowest = std::min(lowest, heater.sensor_celsius);
            elapsed_s += 0.008;
        }
    }
    void forget_extremes() {
        highest = 0;
        lowest = 1e9;
    }
    /// Until the sensor is within 1 °C of the target; how long that took.
    double heat_up(double limit_s = 4000) {
        const double start_s = elapsed_s;
        while (heater.sensor_celsius < target - 1 && elapsed_s - start_s < limit_s) run(0.04);
        return elapsed_s - start_s;
    }
};

/// A heater, and what its machine file says of it.
struct Pair {
    NaiveHeater heater;
    HeaterModel believed;
};

Pair any_pair(std::uint64_t seed, bool bed, double error) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    const auto off = [&](double value) { return value * (1 + error * (2 * unit(random) - 1)); };
    Pair pair;
    HeaterModel& model = pair.believed;
    if (bed) {
        model = {.power_w = 80 + 300 * unit(random),
                 .heat_capacity_j_k = 300 + 700 * unit(random),
                 .loss_w_k = 0.6 + 0.9 * unit(random),
                 .fan_loss_w_k = 0,
                 .sensor_lag_s = 2 + 8 * unit(random),
                 .filament_j_mm3_k = 0};
    } else {
        model = {.power_w = 35 + 30 * unit(random),
                 .heat_capacity_j_k = 10 + 20 * unit(random),
                 .loss_w_k = 0.06 + 0.05 * unit(random),
                 .fan_loss_w_k = 0.03 * unit(random),
                 .sensor_lag_s = 1 + 3 * unit(random),
                 .filament_j_mm3_k = 0.002};
    }
    NaiveHeater& heater = pair.heater;
    heater.power_w = off(model.power_w);
    heater.heat_capacity_j_k = off(model.heat_capacity_j_k);
    heater.loss_w_k = off(model.loss_w_k);
    heater.fan_loss_w_k = off(model.fan_loss_w_k);
    heater.sensor_lag_s = off(model.sensor_lag_s);
    heater.filament_j_mm3_k = off(model.filament_j_mm3_k);
    return pair;
}

TEST(ModelControl, ReachesAndHoldsOnAnyHeaterWhoseNumbersAreTwentyPerCentWrong) {
    for (std::uint64_t seed = 1; seed <= 150; ++seed) {
        const bool bed = seed % 2 == 0;
        const Pair pair = any_pair(seed, bed, 0.2);
        const double target = bed ? 60 : 205;
        const NaiveHeater& metal = pair.heater;
        // Some heaters are too weak for it.
        if (metal.power_w < 1.15 * metal.loss_w_k * (target - 20)) continue;
        Bench bench(pair.believed);
        bench.heater = metal;
        bench.target = target;
        const double waited = bench.heat_up();
        bench.run(60 * approach_s(pair.believed));
        ASSERT_LE(bench.highest, target + 1) << "seed " << seed;
        bench.forget_extremes();
        bench.run(60);
        ASSERT_GT(bench.lowest, target - 1) << "seed " << seed;
        ASSERT_LT(bench.highest, target + 1) << "seed " << seed;
        // Full power, and what the approach takes.
        const double fastest = metal.full_power_time_s(target);
        ASSERT_LT(waited, fastest + 6 * approach_s(pair.believed)) << "seed " << seed;
    }
}

TEST(ModelControl, FanAndFlowAreAnsweredBeforeTheyAreFelt) {
    for (std::uint64_t seed = 1; seed <= 30; ++seed) {
        const Pair pair = any_pair(2 * seed + 1, false, 0.1);
        const double needed_w =
            (pair.heater.loss_w_k + pair.heater.fan_loss_w_k + 12 * pair.heater.filament_j_mm3_k) * 185;
        if (pair.heater.power_w < 1.1 * needed_w) continue;
        Bench bench(pair.believed);
        bench.heater = pair.heater;
        bench.target = 205;
        bench.heat_up();
        bench.run(120);
        bench.forget_extremes();
        bench.fan = 1;
        bench.flow = 12;
        bench.run(120);
        bench.flow = 0;
        bench.run(60);
        bench.fan = 0;
        bench.run(60);
        ASSERT_GT(bench.lowest, 204) << "seed " << seed;
        ASSERT_LT(bench.highest, 206) << "seed " << seed;
    }
}

TEST(ModelControl, KnowsTheBlockBehindTheSensor) {
    Bench bench{HeaterModel{}};
    bench.target = 205;
    while (bench.heater.sensor_celsius < 150) bench.run(0.04);
    EXPECT_GT(bench.heater.block_celsius, bench.heater.sensor_celsius + 2);
    EXPECT_NEAR(bench.control.block_celsius(), bench.heater.block_celsius, 0.4);
}

TEST(ModelControl, FullPowerTellsThePower) {
    Bench bench{HeaterModel{}};
    bench.heater.power_w = 32;
    bench.target = 205;
    while (bench.heater.sensor_celsius < 190) bench.run(0.04);
    EXPECT_NEAR(bench.control.model().power_w, 32, 2.5);
    EXPECT_NEAR(bench.control.extra_w(), 0, 0.3) << "it is not taken for heat from elsewhere";
}

TEST(ModelControl, AWeakHeaterDoesNotWindUp) {
    Bench bench{HeaterModel{}};
    bench.target = 205;
    bench.heat_up();
    bench.run(100);
    bench.heater.loss_w_k = 0.3;  // a draught that full power cannot answer
    bench.run(300);
    ASSERT_LT(bench.heater.sensor_celsius, 180);
    bench.heater.loss_w_k = 0.09;
    bench.heat_up();
    bench.forget_extremes();
    bench.run(200);
    EXPECT_LT(bench.highest, 207);
}

TEST(ModelControl, OffIsNoPowerAndForgetsTheHeatFromElsewhere) {
    Bench bench{HeaterModel{}};
    bench.target = 205;
    bench.heater.loss_w_k = 0.11;
    bench.heat_up();
    bench.run(200);
    EXPECT_LT(bench.control.extra_w(), -0.5);
    bench.target = 0;
    bench.run(1);
    EXPECT_EQ(bench.duty, 0.0);
    EXPECT_EQ(bench.control.extra_w(), 0.0);
}

}  // namespace
}  // namespace qduino::printer::heat::model_control_test
