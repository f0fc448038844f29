// The forecast of a heat-up: against the differential equation in tiny steps, and at its edges.
#include "printer/estimate/heat_forecast.h"

#include <gtest/gtest.h>

#include <cmath>

namespace qduino::printer::estimate::heat_forecast_test {
namespace {

using gcode::Heater;
using gcode::WaitFor;

double wait_for(HeatForecast& forecast, Heater heater, double celsius, WaitFor direction = WaitFor::heating) {
    forecast.set_target(heater, Celsius{celsius});
    return forecast.wait(heater, Celsius{celsius}, direction);
}

/// Full power until the sensor is within a degree, by Euler's method: the least that physics
/// allows.
double least_heat_up_s(const HeaterModel& model, double from_celsius, double to_celsius) {
    double block = from_celsius, sensor = from_celsius, time_s = 0;
    for (const double step_s = 1e-4; sensor < to_celsius - 1; time_s += step_s) {
        block += step_s * (model.power_w - model.loss_w_k * (block - 20)) / model.heat_capacity_j_k;
        sensor += step_s * (block - sensor) / model.sensor_lag_s;
    }
    return time_s;
}

TEST(HeatForecast, TakesWhatPhysicsTakesAndALittleForTheControl) {
    const MachineConfig machine;
    for (const double celsius : {180.0, 210.0, 250.0}) {
        HeatForecast forecast{machine};
        const double waited_s = wait_for(forecast, Heater::hot_end, celsius);
        const double least_s = least_heat_up_s(machine.hot_end.model, 20, celsius);
        EXPECT_GE(waited_s, least_s + 1 - 0.2) << "and a second at the target";
        EXPECT_LE(waited_s, 1.25 * least_s + 10);
        EXPECT_NEAR(forecast.reading(Heater::hot_end).value(), celsius, 5);
    }
}

TEST(HeatForecast, WhatIsHotEnoughWaitsASecond) {
    const MachineConfig machine;
    HeatForecast forecast{machine};
    static_cast<void>(wait_for(forecast, Heater::hot_end, 200));
    forecast.pass(600);
    EXPECT_NEAR(wait_for(forecast, Heater::hot_end, 200), 1.0, 0.11);
    EXPECT_NEAR(wait_for(forecast, Heater::hot_end, 190), 1.0, 0.11) << "M109 S: hotter will do";
    EXPECT_GT(wait_for(forecast, Heater::hot_end, 150, WaitFor::heating_or_cooling), 30);
    EXPECT_NEAR(wait_for(forecast, Heater::hot_end, 0), 0, 0) << "off is no wait";
}

TEST(HeatForecast, TheBedWarmsUpWhileTheHotEndIsWaitedFor) {
    const MachineConfig machine;
    HeatForecast alone{machine};
    const double bed_s = wait_for(alone, Heater::bed, 60);
    HeatForecast both{machine};
    both.set_target(Heater::bed, Celsius{60});
    const double hot_end_s = wait_for(both, Heater::hot_end, 200);
    const double left_s = wait_for(both, Heater::bed, 60);
    EXPECT_NEAR(hot_end_s + left_s, std::max(bed_s, hot_end_s + 1), 1.5);
}

TEST(HeatForecast, CoolsByTheModelWhileItIsNotLookedAt) {
    const MachineConfig machine;
    HeatForecast forecast{machine};
    static_cast<void>(wait_for(forecast, Heater::hot_end, 200));
    forecast.pass(1000);
    forecast.set_target(Heater::hot_end, Celsius{});
    const double time_constant_s = machine.hot_end.model.heat_capacity_j_k / machine.hot_end.model.loss_w_k;
    forecast.pass(3 * time_constant_s);
    // The sensor lags, so it is e^(lag/τ) above the block.
    const double left = 180 * std::exp(-3 + machine.hot_end.model.sensor_lag_s / time_constant_s);
    EXPECT_NEAR(forecast.reading(Heater::hot_end).value(), 20 + left, 0.2);
    forecast.pass(1e6);
    EXPECT_NEAR(forecast.reading(Heater::hot_end).value(), 20, 1e-6);
}

TEST(HeatForecast, ALongTimeInPiecesIsTheSame) {
    const MachineConfig machine;
    HeatForecast at_once{machine}, in_pieces{machine};
    for (HeatForecast* each : {&at_once, &in_pieces}) each->set_target(Heater::bed, Celsius{55});
    at_once.pass(200);
    for (int i = 0; i < 20'000; ++i) in_pieces.pass(0.01);
    EXPECT_NEAR(at_once.reading(Heater::bed).value(), in_pieces.reading(Heater::bed).value(), 0.05);
}

TEST(HeatForecast, AHeaterThatIsTooWeakIsGivenUp) {
    MachineConfig machine;
    machine.bed.model.power_w = 1;
    HeatForecast forecast{machine};
    EXPECT_EQ(wait_for(forecast, Heater::bed, 100), HeatForecast::kNever);
}

TEST(HeatForecast, WhatIsPlayedThroughIsBounded) {
    const MachineConfig machine;
    HeatForecast forecast{machine};
    double waited_s = 0;
    for (int i = 0; i < 2000; ++i) {
        waited_s += wait_for(forecast, Heater::hot_end, i % 2 ? 40 : 200, WaitFor::heating_or_cooling);
        forecast.pass(200);
    }
    EXPECT_GT(waited_s, 3600);
    EXPECT_LT(waited_s, HeatForecast::kPlayed_s + 3600);
    EXPECT_EQ(wait_for(forecast, Heater::hot_end, 250), 0);
    forecast.pass(1000);
    EXPECT_EQ(forecast.reading(Heater::hot_end).value(), 250);
}

TEST(HeatForecast, TimeConstantsThatAreEqualAreNoTrouble) {
    MachineConfig machine;
    machine.hot_end.model.sensor_lag_s =
        machine.hot_end.model.heat_capacity_j_k / machine.hot_end.model.loss_w_k;
    HeatForecast forecast{machine};
    forecast.set_target(Heater::hot_end, Celsius{200});
    forecast.pass(30);
    EXPECT_TRUE(std::isfinite(forecast.reading(Heater::hot_end).value()));
    EXPECT_GT(forecast.reading(Heater::hot_end).value(), 20);
}

}  // namespace
}  // namespace qduino::printer::estimate::heat_forecast_test
