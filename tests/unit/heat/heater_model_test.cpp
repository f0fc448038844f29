// The heater's closed form against small steps of the same equations, and the times that follow
// from it.
#include "printer/heater_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/unit/heat/naive_heater.h"

namespace qduino::printer::heater_model_test {
namespace {

using tests::NaiveHeater;

NaiveHeater naive(const HeaterModel& model) {
    NaiveHeater heater;
    heater.power_w = model.power_w;
    heater.heat_capacity_j_k = model.heat_capacity_j_k;
    heater.loss_w_k = model.loss_w_k;
    heater.fan_loss_w_k = model.fan_loss_w_k;
    heater.sensor_lag_s = model.sensor_lag_s;
    heater.filament_j_mm3_k = model.filament_j_mm3_k;
    return heater;
}

HeaterModel any_model(std::mt19937_64& random) {
    std::uniform_real_distribution<double> unit(0, 1);
    return {.power_w = 20 + 100 * unit(random),
            .heat_capacity_j_k = 5 + 50 * unit(random),
            .loss_w_k = 0.05 + 0.1 * unit(random),
            .fan_loss_w_k = 0.05 * unit(random),
            .sensor_lag_s = 0.5 + 6 * unit(random),
            .filament_j_mm3_k = 0.003 * unit(random)};
}

TEST(HeaterModel, ClosedFormIsTheLimitOfSmallSteps) {
    for (std::uint64_t seed = 1; seed <= 40; ++seed) {
        std::mt19937_64 random(seed);
        std::uniform_real_distribution<double> unit(0, 1);
        const HeaterModel model = any_model(random);
        NaiveHeater oracle = naive(model);
        HeaterState state{20, 20};
        for (int piece = 0; piece < 12; ++piece) {
            const HeaterDrive drive{unit(random), unit(random), 15 * unit(random), 20, 0};
            const double seconds = 0.008 + 20 * unit(random) * unit(random);
            oracle.advance(drive.duty, drive.fan_duty, drive.flow_mm3_s, seconds);
            state = after(model, state, drive, seconds);
            ASSERT_NEAR(state.block_celsius, oracle.block_celsius, 1e-3) << "seed " << seed;
            ASSERT_NEAR(state.sensor_celsius, oracle.sensor_celsius, 1e-3) << "seed " << seed;
        }
    }
}

TEST(HeaterModel, EqualTimeConstantsAreNoSpecialCase) {
    HeaterModel model;
    model.sensor_lag_s = model.heat_capacity_j_k / model.loss_w_k;
    const HeaterState state = after(model, {20, 20}, {.duty = 1}, model.sensor_lag_s);
    const double rise = model.power_w / model.loss_w_k;
    EXPECT_NEAR(state.sensor_celsius, 20 + rise * (1 - 2 * std::exp(-1.0)), 0.01);
}

TEST(HeaterModel, FullPowerTimesAreThoseOfSmallSteps) {
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
        std::mt19937_64 random(seed);
        const HeaterModel model = any_model(random);
        const double target = 60 + 150 * std::uniform_real_distribution<double>(0, 1)(random);
        const double time = full_power_time_s(model, 20, target);
        if (20 + model.power_w / model.loss_w_k <= target) {
            EXPECT_TRUE(std::isinf(time)) << "seed " << seed;
        } else {
            EXPECT_NEAR(time, naive(model).full_power_time_s(target, 20'000), 0.01) << "seed " << seed;
        }
    }
    EXPECT_EQ(full_power_time_s({}, 100, 90), 0);
}

TEST(HeaterModel, AWaitIsALittleLongerThanFullPower) {
    const HeaterModel hot_end;
    const double fastest = full_power_time_s(hot_end, 20, 205);
    const double wait = waiting_time_s(hot_end, 20, 205, 1, 1);
    EXPECT_GT(wait, fastest);
    EXPECT_LT(wait, 1.1 * fastest);
    EXPECT_EQ(waiting_time_s(hot_end, 205, 205, 1, 1), 1) << "it is there";
    EXPECT_TRUE(std::isinf(waiting_time_s(hot_end, 20, 600, 1, 1)));
}

}  // namespace
}  // namespace qduino::printer::heater_model_test
