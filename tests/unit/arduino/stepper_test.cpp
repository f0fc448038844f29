// FastAccelStepper: the ramp against its equations, and two motors on the simulator.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "arduino/core/loops.h"
#include "arduino/libraries/FastAccelStepper/FastAccelStepper.h"
#include "board/board.h"
#include "board/peripherals.h"
#include "board/sim/sim_board.h"
#include "runtime/runtime.h"

namespace stepper_test {
namespace {

using namespace qduino;
using qduino::arduino::StepRamp;

StepRamp ramp_of(double speed, double acceleration, std::int64_t target) {
    StepRamp ramp;
    ramp.set_speed(speed);
    ramp.set_acceleration(acceleration);
    ramp.set_target(target);
    return ramp;
}

/// Seconds to the target.
double duration(StepRamp ramp, std::int64_t* steps = nullptr) {
    double sum = 0;
    std::int64_t count = 0;
    while (const auto step = ramp.next()) {
        sum += step->seconds;
        ++count;
    }
    if (steps) *steps = count;
    return sum;
}

TEST(StepRamp, AMoveTakesWhatATrapezoidTakes) {
    for (const std::int64_t n : {1000, -5000}) {
        std::int64_t steps = 0;
        const double speed = 800, acceleration = 2000;
        EXPECT_NEAR(duration(ramp_of(speed, acceleration, n), &steps),
                    static_cast<double>(std::abs(n)) / speed + speed / acceleration, 2e-3);
        EXPECT_EQ(steps, std::abs(n));
    }
    // Too short for its speed: a triangle, 2 √(n/a).
    EXPECT_NEAR(duration(ramp_of(1e6, 2000, 400)), 2 * std::sqrt(400 / 2000.0), 5e-3);
    EXPECT_NEAR(duration(ramp_of(1e6, 2000, 1)), 2 * std::sqrt(1 / 2000.0), 1e-9);
    EXPECT_NEAR(duration(ramp_of(2, 2000, 10)), 5, 0.01);  // slower than its first step could be
}

TEST(StepRamp, WhateverIsAskedItKeepsItsBoundsAndArrives) {
    std::mt19937 random(15);
    for (int round = 0; round < 300; ++round) {
        double speed = 10 + random() % 5000, fastest = speed;
        const double acceleration = 10 + random() % 20000;
        StepRamp ramp = ramp_of(speed, acceleration, 0);
        double before = 0;
        for (int i = 0; i < 400; ++i) {
            if (random() % 20 == 0) ramp.set_target(static_cast<int>(random() % 2000) - 1000);
            if (random() % 50 == 0) ramp.set_speed(speed = 10 + random() % 5000);
            if (random() % 80 == 0) ramp.stop();
            fastest = std::max(fastest, speed);
            const auto step = ramp.next();
            if (!step) break;
            ASSERT_GT(step->seconds, 0);
            ASSERT_LE(std::abs(ramp.velocity()), fastest * (1 + 1e-9));
            // v² changes by 2a in a step, and the direction only from rest.
            const double now = ramp.velocity();
            const double square =
                before * now >= 0 ? now * now - before * before : now * now + before * before;
            ASSERT_LE(std::abs(square), 4 * acceleration * (1 + 1e-9)) << before << " to " << now;
            before = now;
        }
        const std::int64_t target = ramp.target();
        while (ramp.next()) {
        }
        ASSERT_EQ(ramp.position(), target);
        ASSERT_EQ(ramp.velocity(), 0);
    }
}

TEST(StepRamp, StoppingTakesAsFarAsItNeedsAndHaltingNothing) {
    StepRamp ramp = ramp_of(1000, 1000, 100'000);
    for (int i = 0; i < 600; ++i) ramp.next();
    EXPECT_NEAR(ramp.velocity(), 1000, 1);
    ramp.stop();
    EXPECT_EQ(ramp.target(), 600 + 500);
    ramp.halt();
    EXPECT_EQ(ramp.target(), 600);
    EXPECT_FALSE(ramp.next());
    ramp.set_position(-7);
    EXPECT_FALSE(ramp.next());
    EXPECT_EQ(ramp.position(), -7);
}

// ---- on the simulator ---------------------------------------------------------------------------

constexpr std::uint8_t kStep = 2, kDirection = 3, kEnable = 4, kOtherStep = 5;

/// The motors: counts what is wired to them.
class Motors final : public board::NoPeripherals {
  public:
    struct Rise {
        Instant at;
        int direction;
        bool enabled;
    };
    void pin_written(Instant now, board::PinId pin, board::Level level) override {
        const bool rises = level == board::Level::high && !high_[pin.number];
        high_[pin.number] = level == board::Level::high;
        if (rises && pin.number == kStep) steps.push_back({now, high_[kDirection] ? 1 : -1, !high_[kEnable]});
        if (rises && pin.number == kOtherStep) ++others;
    }

    std::vector<Rise> steps;
    int others = 0;
    [[nodiscard]] bool enabled() const { return !high_[kEnable]; }

  private:
    std::array<bool, board::kPinCount> high_{};
};

FastAccelStepperEngine engine;
FastAccelStepper *one = nullptr, *other = nullptr;
std::int8_t without_speed = 0, without_direction = 0;
std::int32_t position_at_stop = 0;

void setup() {
    engine.init();
    one = engine.stepperConnectToPin(kStep);
    one->setDirectionPin(kDirection);
    one->setEnablePin(kEnable);
    one->setAutoEnable(true);
    one->setDelayToEnable(500);
    one->setDelayToDisable(20);
    without_speed = one->move(10);
    one->setSpeedInHz(2000);
    one->setAcceleration(10'000);
    other = engine.stepperConnectToPin(kOtherStep);
    other->setSpeedInUs(1000);
    other->setAcceleration(100'000);
    without_direction = other->move(-1);
    one->move(1000);
    other->runForward();
}

void course() {
    while (one->isRunning()) delay(1);
    one->moveTo(400, true);
    position_at_stop = one->getCurrentPosition();
    other->stopMove();
    delay(1000);
}
const qduino::arduino::SketchRegistration registration(setup, course, nullptr, "test");

TEST(FastAccelStepper, TwoMotorsMoveWhileTheSketchWaits) {
    Motors motors;
    board::sim::SimConfig config;
    config.cores = 2;
    board::sim::SimBoard board(config, motors);
    runtime::Runtime runtime(board);
    const Result<void> begun = runtime.begin(runtime::sketch_table());
    ASSERT_TRUE(begun.ok()) << begun.error().message.view();
    runtime.run(kEpoch + 2s);
    EXPECT_EQ(without_speed, MOVE_ERR_SPEED_IS_UNDEFINED);
    EXPECT_EQ(without_direction, MOVE_ERR_NO_DIRECTION_PIN);
    ASSERT_EQ(motors.steps.size(), 1600u);
    EXPECT_TRUE(std::all_of(motors.steps.begin(), motors.steps.begin() + 1000,
                            [](const auto& step) { return step.direction == 1; }));
    EXPECT_TRUE(std::all_of(motors.steps.begin() + 1000, motors.steps.end(),
                            [](const auto& step) { return step.direction == -1; }));
    EXPECT_TRUE(std::ranges::all_of(motors.steps, &Motors::Rise::enabled));
    EXPECT_FALSE(motors.enabled());
    EXPECT_EQ(position_at_stop, 400);
    EXPECT_EQ(one->getCurrentPosition(), 400);
    // The first step is as late as it is enabled; behind it all keep the ramp's instants.
    const double first_to_last =
        std::chrono::duration<double>(motors.steps[999].at - motors.steps[0].at).count();
    EXPECT_NEAR(first_to_last, 1000 / 2000.0 + 2000 / 10'000.0 - std::sqrt(2 / 10'000.0), 3e-3);
    EXPECT_GT(motors.others, 900);
    EXPECT_EQ(other->getCurrentPosition(), motors.others);
    EXPECT_FALSE(other->isRunning());
    board.request_stop();
    runtime.run(board.now() + 1s);
}

}  // namespace
}  // namespace stepper_test
