#include "twin/printer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "tests/unit/twin/pin_player.h"

namespace qduino::twin::printer_test {
namespace {

using board::Level;
using board::PinId;
using testing::PinPlayer;

constexpr Nanoseconds us(std::int64_t microseconds) { return Nanoseconds{microseconds * 1000}; }

struct Recorder final : MotionObserver {
    std::vector<StepSeen> steps;
    std::vector<std::pair<int, bool>> switches;
    void on_step(const StepSeen& step) override { steps.push_back(step); }
    void on_endstop(Instant, int axis, bool pressed) override { switches.emplace_back(axis, pressed); }
};

TEST(TwinPrinter, CountsStepsBothWays) {
    Printer printer{Machine{}};
    PinPlayer player(printer);
    const std::int64_t start = printer.axis(0).position();
    player.steps(0, 1, 500, us(200));
    player.steps(0, -1, 120, us(200));
    EXPECT_EQ(printer.axis(0).position(), start + 380);
    EXPECT_EQ(printer.state(player.now).counters[0].moved, 620u);
    EXPECT_EQ(printer.state(player.now).counters[0].lost(), 0u);
    EXPECT_EQ(printer.state(player.now).timing_violations, 0u);
}

TEST(TwinPrinter, AnInvertedAxisMovesTheOtherWay) {
    Machine machine;
    machine.axes[1].direction_inverted = true;
    Printer printer{machine};
    const std::int64_t start = printer.axis(1).position();
    printer.pin_written(instant_from_ns(0), PinId{7}, Level::high);  // DIR
    printer.pin_written(instant_from_ns(1000), PinId{6}, Level::high);
    printer.pin_written(instant_from_ns(3000), PinId{6}, Level::low);
    EXPECT_EQ(printer.axis(1).position(), start - 1);
}

// The oracle counts with the rules as the data sheet words them, on all edges at once, after the
// fact.
TEST(TwinPrinter, RandomPulsesAgreeWithAnOracleOnTheirTimings) {
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
        std::mt19937_64 random(seed);
        Printer printer{Machine{}};
        const std::int64_t start = printer.axis(3).position();
        std::int64_t expected = start;
        std::int64_t now = 10'000;
        std::int64_t fell = 0, turned = 0;
        bool up = false;
        for (int pulse = 0; pulse < 2000; ++pulse) {
            now += 100'000 + static_cast<std::int64_t>(random() % 1000);
            if (random() % 4 == 0) {
                up = !up;
                turned = now;
                printer.pin_written(instant_from_ns(now), PinId{15}, up ? Level::high : Level::low);
            }
            const std::int64_t rise = now + static_cast<std::int64_t>(random() % 400);
            const std::int64_t fall = rise + 500 + static_cast<std::int64_t>(random() % 1000);
            printer.pin_written(instant_from_ns(rise), PinId{14}, Level::high);
            printer.pin_written(instant_from_ns(fall), PinId{14}, Level::low);
            if (rise - turned >= 200 && fall - rise >= 1000 && rise - fell >= 1000) expected += up ? 1 : -1;
            fell = fall;
            now = fall;
        }
        ASSERT_EQ(printer.axis(3).position(), expected) << "seed " << seed;
        const AxisCounters counters = printer.state(instant_from_ns(now)).counters[3];
        ASSERT_EQ(counters.moved + counters.lost_timing, 2000u) << "seed " << seed;
        ASSERT_GT(counters.lost_timing, 100u) << "the test must meet violations";
    }
}

TEST(TwinPrinter, ADisabledMotorStaysWhereItIs) {
    Printer printer{Machine{}};
    PinPlayer player(printer);
    const std::int64_t start = printer.axis(0).position();
    printer.pin_written(player.now, PinId{4}, Level::high);
    player.steps(0, 1, 10, us(500));
    EXPECT_EQ(printer.axis(0).position(), start);
    EXPECT_EQ(printer.state(player.now).counters[0].ignored_disabled, 10u);
    EXPECT_FALSE(printer.state(player.now).enabled[0]);
    printer.pin_written(player.now, PinId{4}, Level::low);
    player.steps(0, 1, 10, us(500));
    EXPECT_EQ(printer.axis(0).position(), start + 10);
}

TEST(TwinPrinter, ASharedEnableLineServesAllItsMotors) {
    Machine machine;
    for (AxisSpec& axis : machine.axes) axis.enable_pin = 4;
    Printer printer{machine};
    printer.pin_written(kEpoch, PinId{4}, Level::high);
    for (const bool enabled : printer.state(kEpoch).enabled) EXPECT_FALSE(enabled);
}

TEST(TwinPrinter, TheSwitchClosesAtItsPlaceAndTheFrameStopsTheCarriage) {
    Machine machine;
    machine.axes[0].trigger_mm = 0.25;  // 20 steps
    Printer printer{machine};
    Recorder recorder;
    printer.observe(&recorder);
    PinPlayer player(printer);
    EXPECT_FALSE(player.pressed(0));
    while (!player.pressed(0)) player.step(0, -1, us(200));
    EXPECT_EQ(printer.axis(0).position(), 20);
    ASSERT_EQ(recorder.switches.size(), 1u);
    EXPECT_EQ(recorder.switches[0], std::make_pair(0, true));
    player.steps(0, -1, 1000, us(200));
    EXPECT_EQ(printer.axis(0).position(), -160) << "2 mm below zero stands the frame";
    EXPECT_EQ(printer.state(player.now).counters[0].lost_hard_stop, 820u);
    player.steps(0, 1, 181, us(200));
    EXPECT_FALSE(player.pressed(0));
    EXPECT_EQ(recorder.switches.back(), std::make_pair(0, false));
    EXPECT_EQ(recorder.steps.size(), printer.state(player.now).counters[0].moved)
        << "lost steps are not shown";
}

TEST(TwinPrinter, ASwitchAtTheMaximumEnd) {
    Machine machine;
    machine.axes[0].trigger_at_minimum = false;
    machine.axes[0].trigger_mm = 150;
    Printer printer{machine};
    PinPlayer player(printer);
    int steps = 0;
    for (; !player.pressed(0); ++steps) player.step(0, 1, us(200));
    EXPECT_EQ(steps, static_cast<int>(150 * 80 - std::llround(37.3 * 80)));
}

TEST(TwinPrinter, ABouncingSwitchSettles) {
    Machine machine;
    machine.axes[0].start_mm = 0.0125;
    machine.axes[0].bounce = us(2000);
    Printer printer{machine};
    PinPlayer player(printer);
    player.step(0, -1, us(3));
    int changes = 0;
    bool last = player.pressed(0);
    for (int i = 0; i < 300; ++i) {
        player.wait(us(10));
        if (player.pressed(0) != last) ++changes;
        last = player.pressed(0);
    }
    EXPECT_TRUE(last);
    EXPECT_GT(changes, 5);
}

// ---- what a motor can follow --------------------------------------------------------------------

struct MotorBench {
    Machine machine = [] {
        Machine weak;
        weak.axes[0].motor = {16, 2000, 20'000, 100'000};
        weak.axes[0].hard_maximum_mm = 1e6;
        return weak;
    }();
    Printer printer{machine};
    PinPlayer player{printer};

    void run(double steps_s, int count) { player.steps(0, 1, count, from_seconds(1 / steps_s)); }
    /// Speeds up evenly at `steps_s2` from `from` to `to`.
    void ramp(double from, double to, double steps_s2) {
        for (double speed = from; speed < to; speed = std::sqrt(speed * speed + 2 * steps_s2))
            player.step(0, 1, from_seconds(1 / speed));
    }
    [[nodiscard]] std::uint64_t lost() { return printer.state(player.now).counters[0].lost_pull_out; }
};

TEST(TwinMotor, FollowsBelowPullInWithAnyGaps) {
    MotorBench bench;
    std::mt19937_64 random(7);
    for (int i = 0; i < 5000; ++i) {
        bench.run(1990, 1);
        if (random() % 10 == 0) bench.player.wait(us(static_cast<std::int64_t>(random() % 20'000)));
    }
    EXPECT_EQ(bench.lost(), 0u);
}

TEST(TwinMotor, AStartFromRestAbovePullInIsLost) {
    MotorBench bench;
    bench.run(8000, 800);
    // 8000 steps/s: one full step is allowed to lag, the next is judged at a window of rest.
    EXPECT_GT(bench.lost(), 700u);
    EXPECT_TRUE(bench.printer.state(bench.player.now).counters[0].moved < 100);
}

TEST(TwinMotor, TheSameSpeedIsReachedOnARamp) {
    MotorBench bench;
    bench.ramp(500, 8000, 80'000);
    bench.run(8000, 2000);
    EXPECT_EQ(bench.lost(), 0u);
}

TEST(TwinMotor, ARampSteeperThanItsTorqueIsLost) {
    MotorBench bench;
    bench.ramp(500, 15'000, 1'500'000);
    bench.run(15'000, 100);
    EXPECT_GT(bench.lost(), 0u);
}

TEST(TwinMotor, AbovePullOutEverythingIsLostUntilItIsSlowAgain) {
    MotorBench bench;
    bench.ramp(500, 25'000, 80'000);
    bench.run(25'000, 500);
    const std::uint64_t lost = bench.lost();
    EXPECT_GT(lost, 500u);
    bench.run(10'000, 500);
    EXPECT_GT(bench.lost(), lost + 400)
        << "a stalled motor does not catch a field that turns faster than pull-in";
    bench.run(1500, 40);
    const std::uint64_t settled = bench.lost();
    bench.run(1500, 500);
    EXPECT_EQ(bench.lost(), settled);
}

TEST(TwinMotor, AStalledMotorStartsAnewTheOtherWay) {
    MotorBench bench;
    bench.run(25'000, 500);
    const std::uint64_t lost = bench.lost();
    EXPECT_GT(lost, 400u);
    bench.player.steps(0, -1, 100, from_seconds(1 / 1500.0));
    EXPECT_EQ(bench.lost(), lost);
}

TEST(TwinMotor, OneEarlyStepIsForgivenABunchIsNot) {
    MotorBench bench;
    bench.run(1800, 200);
    bench.run(150'000, 1);  // 7 µs: a microstep is a sixteenth of what may lag
    bench.run(1800, 200);
    EXPECT_EQ(bench.lost(), 0u);
    bench.run(150'000, 60);
    EXPECT_GT(bench.lost(), 20u);
}

TEST(TwinMotor, DitherAboutOnePlaceIsHarmless) {
    MotorBench bench;
    for (int i = 0; i < 1000; ++i) {
        bench.player.step(0, 1, us(5));
        bench.player.step(0, -1, us(5));
    }
    EXPECT_EQ(bench.lost(), 0u);
}

TEST(TwinMotor, TheReferenceMachineLosesNothingAtItsOwnLimits) {
    Printer printer{Machine{}};
    PinPlayer player(printer);
    player.steps(0, 1, 8000, us(100));  // 125 mm/s at once, from rest
    EXPECT_EQ(printer.state(player.now).counters[0].lost(), 0u);
}

}  // namespace
}  // namespace qduino::twin::printer_test
