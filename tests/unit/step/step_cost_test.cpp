// The cost of a step is that of the player's own work, and measuring it moves no motor.
#include "printer/step/step_cost.h"

#include <gtest/gtest.h>

#include "tests/unit/step/virtual_pins.h"

namespace qduino::printer::step::step_cost_test {
namespace {

/// All batches, one after another.
template <typename Pins>
Nanoseconds measured(Pins& pins) {
    StepCost cost;
    while (!cost.done()) cost.measure(pins);
    return cost.one_step();
}

TEST(StepCost, IsTheTimeOfBothEdges) {
    test::VirtualPins pins;
    pins.write_cost_ns = 300;
    EXPECT_EQ(measured(pins), 600ns);
    pins.write_cost_ns = 5000;
    EXPECT_EQ(measured(pins), 10us);
}

TEST(StepCost, MovesNoMotor) {
    test::VirtualPins pins;
    pins.write_cost_ns = 100;
    static_cast<void>(measured(pins));
    EXPECT_TRUE(pins.edges.empty());
}

TEST(StepCost, IsTheMedianWhatElseTookTheCoreIsNoPartOfIt) {
    struct Disturbed : test::VirtualPins {
        void set_steps(const MotorList& axes, bool high) {
            if (++count % 1000 == 0) now_ns += 3'000'000;  // another task, for 3 ms
            VirtualPins::set_steps(axes, high);
        }
        int count = 0;
    } pins;
    pins.write_cost_ns = 300;
    EXPECT_EQ(measured(pins), 600ns);
}

TEST(StepCost, WhatWasMeasuredSoFarCounts) {
    StepCost cost;
    EXPECT_EQ(cost.one_step(), 0ns) << "nothing was";
    test::VirtualPins pins;
    pins.write_cost_ns = 300;
    cost.measure(pins);
    EXPECT_FALSE(cost.done());
    EXPECT_EQ(cost.one_step(), 600ns);
}

TEST(StepCost, TheLimitLeavesPartOfTheCore) {
    EXPECT_DOUBLE_EQ(step_rate_limit_hz(500ns), 1'400'000);
    EXPECT_DOUBLE_EQ(step_rate_limit_hz(Nanoseconds{0}), 0) << "not known: no limit";
}

}  // namespace
}  // namespace qduino::printer::step::step_cost_test
