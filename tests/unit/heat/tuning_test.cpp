// The experiments on heaters whose numbers are known to the test alone.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "printer/heat/heater_tuning.h"
#include "printer/heat/pid.h"
#include "tests/unit/heat/naive_heater.h"

namespace qduino::printer::heat::tuning_test {
namespace {

using tests::NaiveHeater;

/// Runs an experiment to its end; the fan is at what the experiment says.
TuningReport tuned(NaiveHeater heater, const TuningRequest& request, const HeaterConfig& config,
                   double limit_s = 7200) {
    HeaterTuning tuning;
    tuning.begin(request, config);
    double duty = 0, fan = 0;
    for (double seconds = 0; seconds < limit_s && tuning.runs(); seconds += 0.008) {
        const ModelTuning::Output output = tuning.sample(Celsius{heater.reading()}, duty, 0.008);
        duty = output.duty;
        fan = output.fan.value_or(0);
        heater.advance(duty, fan, 0, 0.008, 0.004);
    }
    return tuning.report();
}

TuningRequest model_at(double celsius, bool of_bed = false) {
    return {.number = 1, .kind = HeaterControl::model, .of_bed = of_bed, .target = Celsius{celsius}};
}

TEST(Tuning, FindsTheModelOfAnyHotEnd) {
    for (std::uint64_t seed = 1; seed <= 30; ++seed) {
        std::mt19937_64 random(seed);
        std::uniform_real_distribution<double> unit(0, 1);
        NaiveHeater heater;
        heater.power_w = 38 + 30 * unit(random);
        heater.heat_capacity_j_k = 8 + 25 * unit(random);
        heater.loss_w_k = 0.07 + 0.05 * unit(random);
        heater.fan_loss_w_k = 0.04 * unit(random);
        heater.sensor_lag_s = 1 + 4 * unit(random);
        heater.block_celsius = heater.sensor_celsius = heater.room_celsius = 15 + 12 * unit(random);
        HeaterConfig config;
        config.model.power_w = heater.power_w;  // it is printed on the cartridge
        const TuningReport report = tuned(heater, model_at(200), config);
        ASSERT_EQ(report.state, TuningState::done) << report.why.view() << " seed " << seed;
        const HeaterModel& found = report.found.model;
        EXPECT_NEAR(found.heat_capacity_j_k / heater.heat_capacity_j_k, 1, 0.06) << "seed " << seed;
        EXPECT_NEAR(found.loss_w_k / heater.loss_w_k, 1, 0.03) << "seed " << seed;
        EXPECT_NEAR(found.fan_loss_w_k, heater.fan_loss_w_k, 0.005) << "seed " << seed;
        EXPECT_NEAR(found.sensor_lag_s / heater.sensor_lag_s, 1, 0.2) << "seed " << seed;
        EXPECT_EQ(found.power_w, heater.power_w);
    }
}

TEST(Tuning, FindsTheModelOfABed) {
    NaiveHeater bed{.power_w = 220,
                    .heat_capacity_j_k = 900,
                    .loss_w_k = 1.4,
                    .fan_loss_w_k = 0,
                    .sensor_lag_s = 9,
                    .filament_j_mm3_k = 0};
    HeaterConfig config = MachineConfig{}.bed;
    config.model.power_w = 220;
    const TuningReport report = tuned(bed, model_at(60, true), config);
    ASSERT_EQ(report.state, TuningState::done) << report.why.view();
    EXPECT_NEAR(report.found.model.heat_capacity_j_k, 900, 25);
    EXPECT_NEAR(report.found.model.loss_w_k, 1.4, 0.05);
    EXPECT_NEAR(report.found.model.sensor_lag_s, 9, 1);
}

TEST(Tuning, AWarmOrDeadHeaterIsNoExperiment) {
    NaiveHeater warm;
    warm.loss_w_k = 0.001;
    warm.block_celsius = warm.sensor_celsius = 150;
    EXPECT_NE(tuned(warm, model_at(200), {}).why.view().find("not cooled"), std::string_view::npos);
    NaiveHeater dead;
    dead.power_w = 3;
    EXPECT_NE(tuned(dead, model_at(200), {}).why.view().find("half an hour"), std::string_view::npos);
}

TEST(Tuning, StopsWhenAskedTo) {
    HeaterTuning tuning;
    tuning.begin(model_at(200), {});
    tuning.stop("it was stopped");
    EXPECT_EQ(tuning.report().state, TuningState::failed);
    EXPECT_EQ(tuning.report().number, 1u);
}

/// The swing of a relay on a known plant, by the describing function: the phase of the plant is
/// −180° at the ultimate frequency.
TEST(Tuning, TheSwingIsAtTheUltimateFrequency) {
    NaiveHeater heater;
    TuningRequest request{.number = 1, .kind = HeaterControl::pid, .target = Celsius{200}, .swings = 8};
    const TuningReport report = tuned(heater, request, {});
    ASSERT_EQ(report.state, TuningState::done) << report.why.view();
    const HeaterSettings& found = report.found;
    EXPECT_GT(found.kp, 0);
    const double period_s = 2 * found.kp / found.ki;
    EXPECT_NEAR(found.kd, found.kp * period_s / 8, 1e-9);
    EXPECT_GT(period_s, 2) << "a heater with two bodies and a sampled relay swings within seconds";
    EXPECT_LT(period_s, 40);
}

TEST(Tuning, TunedGainsHold) {
    for (const bool of_bed : {false, true}) {
        NaiveHeater heater;
        if (of_bed) heater = {.power_w = 100, .heat_capacity_j_k = 400, .loss_w_k = 0.9, .sensor_lag_s = 6};
        const double target = of_bed ? 60 : 205;
        const TuningRequest request{.number = 1,
                                    .kind = HeaterControl::pid,
                                    .of_bed = of_bed,
                                    .target = Celsius{target},
                                    .swings = 6};
        const TuningReport report = tuned(heater, request, {}, 20'000);
        ASSERT_EQ(report.state, TuningState::done) << report.why.view();
        Pid pid{{report.found.kp, report.found.ki, report.found.kd}};
        double furthest = 0;
        for (double seconds = 0; seconds < 1500; seconds += 0.008) {
            heater.advance(pid.update(target, heater.reading(), 0.008), 0, 0, 0.008, 0.004);
            if (seconds > 1300) furthest = std::max(furthest, std::abs(heater.sensor_celsius - target));
        }
        EXPECT_LT(furthest, 1) << (of_bed ? "bed" : "hot end");
    }
}

}  // namespace
}  // namespace qduino::printer::heat::tuning_test
