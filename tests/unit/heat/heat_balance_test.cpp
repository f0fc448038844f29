// Rule 5: energy that is given, lost and stored. Random good heaters never break it; broken ones
// do.
#include "printer/heat/heat_balance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <random>

#include "printer/heat/filament_flow.h"
#include "printer/heat/model_control.h"
#include "tests/unit/heat/naive_heater.h"

namespace qduino::printer::heat::heat_balance_test {
namespace {

using tests::NaiveHeater;
using Verdict = HeatBalance::Verdict;

struct Bench {
    explicit Bench(const HeaterModel& believed) : balance(believed), control(believed) {}

    NaiveHeater heater;
    HeatBalance balance;
    ModelControl control;
    double target = 0, duty = 0, fan = 0, flow = 0;
    double reads_less = 0;
    std::optional<double> stuck_at;   // the sensor
    double step = 0;                  // of the converter, °C; 0: none
    std::optional<double> driven_at;  // the heater, whatever is asked

    [[nodiscard]] double shown(double celsius) const {
        return step > 0 ? step * std::round(celsius / step) : celsius;
    }
    /// The first verdict that is not `fits`, or that after `seconds`.
    Verdict run(double seconds, double reads_less_per_s = 0) {
        for (double at = 0; at < seconds; at += 0.008) {
            reads_less += reads_less_per_s * 0.008;
            const double reading = stuck_at.value_or(shown(heater.reading() - reads_less));
            const HeaterDrive drive{duty, fan, flow, 20, 0};
            const Verdict verdict = balance.sample(reading, drive, 0.008);
            if (verdict != Verdict::fits) return verdict;
            duty = control.update({reading, target, duty, 0.008, fan, flow, 20});
            heater.advance(driven_at.value_or(duty), fan, flow, 0.008, 0.004);
        }
        return Verdict::fits;
    }
};

TEST(HeatBalance, AHeaterWhoseNumbersAreFifteenPerCentWrongFits) {
    for (std::uint64_t seed = 1; seed <= 100; ++seed) {
        std::mt19937_64 random(seed);
        std::uniform_real_distribution<double> unit(-1, 1);
        const HeaterModel model;
        Bench bench(model);
        bench.step = 0.4 * static_cast<double>(seed % 3);  // a thermistor's at 250 °C: 0.8
        const auto off = [&](double value) { return value * (1 + 0.15 * unit(random)); };
        bench.heater.power_w = off(model.power_w);
        bench.heater.heat_capacity_j_k = off(model.heat_capacity_j_k);
        bench.heater.loss_w_k = off(model.loss_w_k);
        bench.heater.fan_loss_w_k = off(model.fan_loss_w_k);
        bench.heater.sensor_lag_s = off(model.sensor_lag_s);
        for (const double target : {205.0, 170.0, 230.0, 0.0, 100.0}) {
            bench.target = target;
            ASSERT_EQ(bench.run(150), Verdict::fits) << "seed " << seed;
            bench.fan = bench.fan > 0 ? 0 : 1;
            bench.flow = bench.fan > 0 && target > 150 ? 10 : 0;
            ASSERT_EQ(bench.run(100), Verdict::fits) << "seed " << seed;
        }
    }
}

TEST(HeatBalance, PowerThatNobodyAskedForIsFoundWithinTwoWindows) {
    Bench bench{HeaterModel{}};
    bench.run(20);
    bench.driven_at = 1;
    EXPECT_EQ(bench.run(3 * bench.balance.window_s()), Verdict::too_hot);
    EXPECT_LT(bench.heater.sensor_celsius, 110);
}

TEST(HeatBalance, AHeaterThatNoLongerHeats) {
    Bench bench{HeaterModel{}};
    bench.target = 205;
    ASSERT_EQ(bench.run(300), Verdict::fits);
    bench.driven_at = 0;
    EXPECT_EQ(bench.run(60), Verdict::too_cold);
}

TEST(HeatBalance, ASensorThatStandsStill) {
    Bench bench{HeaterModel{}};
    bench.target = 205;
    ASSERT_EQ(bench.run(300), Verdict::fits);
    bench.stuck_at = 204;
    EXPECT_EQ(bench.run(300), Verdict::too_cold);
    EXPECT_LT(bench.heater.block_celsius, 300);
}

TEST(HeatBalance, ASensorThatFreezesAtItsTarget) {
    for (const double off : {-0.02, 0.02, -0.2}) {
        Bench bench{HeaterModel{}};
        bench.target = 205;
        ASSERT_EQ(bench.run(300), Verdict::fits);
        bench.stuck_at = 205 + off;
        EXPECT_EQ(bench.run(3000), Verdict::frozen) << off;
        EXPECT_NEAR(bench.heater.block_celsius, 205, 25) << off;
    }
}

TEST(HeatBalance, ASensorThatReadsEverColder) {
    Bench bench{HeaterModel{}};
    bench.target = 205;
    ASSERT_EQ(bench.run(300), Verdict::fits);
    EXPECT_EQ(bench.run(600, 0.5), Verdict::too_cold);
    EXPECT_LT(bench.heater.block_celsius, 330);
}

TEST(FilamentFlow, CountsOnlyFilamentThatIsNew) {
    const MachineConfig config;
    FilamentFlow flow{config};
    const double step_mm3 = filament_area_mm2(config) / config.axes[Axis::e].steps_per_mm;
    std::int64_t steps = 0;
    double seen = 0;
    for (int i = 0; i < 1000; ++i) seen = flow.sample(steps += 4, 0.008);
    EXPECT_NEAR(seen, 4 * step_mm3 / 0.008, 1e-6);
    for (int i = 0; i < 1000; ++i) seen = flow.sample(steps -= 1, 0.008);
    EXPECT_NEAR(seen, 0, 1e-6);
    for (int i = 0; i < 1000; ++i) seen = flow.sample(steps += 1, 0.008);
    EXPECT_NEAR(seen, 0, 1e-6) << "it was molten already";
    for (int i = 0; i < 1000; ++i) seen = flow.sample(steps += 1, 0.008);
    EXPECT_NEAR(seen, step_mm3 / 0.008, 1e-6);
}

}  // namespace
}  // namespace qduino::printer::heat::heat_balance_test
