#include "printer/machine/heat_wait.h"

#include <gtest/gtest.h>

namespace qduino::printer::machine::heat_wait_test {
namespace {

constexpr Instant kStart = instant_from_ns(0);

/// Waits for `target`; the heater's numbers are the default: within 1 °C for 1 s.
struct Bench {
    explicit Bench(double target, gcode::WaitFor direction = gcode::WaitFor::heating) {
        wait.begin(gcode::Heater::hot_end, Celsius{target}, direction);
    }
    bool at(double seconds, double celsius) {
        return wait.is_over(kStart + from_seconds(seconds), Celsius{celsius}, config);
    }
    HeatWait wait;
    HeaterConfig config;
};

TEST(HeatWait, IsOverWhenTheHeaterHasBeenNearForItsTime) {
    Bench bench(200);
    EXPECT_FALSE(bench.at(0, 100));
    EXPECT_FALSE(bench.at(1, 199));
    EXPECT_FALSE(bench.at(1.9, 199.5));
    EXPECT_TRUE(bench.wait.active());
    EXPECT_TRUE(bench.at(2, 199.5));
    EXPECT_FALSE(bench.wait.active());
}

TEST(HeatWait, ADipBeginsTheTimeAnew) {
    Bench bench(200);
    EXPECT_FALSE(bench.at(1, 199.5));
    EXPECT_FALSE(bench.at(1.5, 198.9));
    EXPECT_FALSE(bench.at(2, 199.5));
    EXPECT_FALSE(bench.at(2.5, 199.5));
    EXPECT_TRUE(bench.at(3, 199.5));
}

TEST(HeatWait, HeatingIsContentWithTooHot) {
    Bench bench(60);
    EXPECT_FALSE(bench.at(0, 200));
    EXPECT_TRUE(bench.at(1, 199));
}

TEST(HeatWait, EitherWayWaitsForTheCoolingToo) {
    Bench bench(60, gcode::WaitFor::heating_or_cooling);
    EXPECT_FALSE(bench.at(0, 200));
    EXPECT_FALSE(bench.at(5, 61.1));
    EXPECT_FALSE(bench.at(6, 61));
    EXPECT_TRUE(bench.at(7, 60.5));
}

TEST(HeatWait, OffIsNotWaitedFor) {
    EXPECT_TRUE(Bench(0).at(0, 200));
    EXPECT_FALSE(Bench(0, gcode::WaitFor::heating_or_cooling).at(0, 200)) << "M109 R0 waits until it is cold";
}

TEST(HeatWait, ASecondWaitBeginsFresh) {
    Bench bench(200);
    EXPECT_FALSE(bench.at(0, 200));
    bench.wait.begin(gcode::Heater::bed, Celsius{60}, gcode::WaitFor::heating);
    EXPECT_EQ(bench.wait.heater(), gcode::Heater::bed);
    EXPECT_FALSE(bench.at(1, 60));
    bench.wait.clear();
    EXPECT_FALSE(bench.wait.active());
}

}  // namespace
}  // namespace qduino::printer::machine::heat_wait_test
