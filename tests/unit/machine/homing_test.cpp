#include "printer/machine/homing.h"

#include <gtest/gtest.h>

namespace qduino::printer::machine::homing_test {
namespace {

using Phase = Homing::Phase;

TEST(Homing, OneAxisIsApproachedFastThenSlow) {
    MachineConfig config;
    Homing homing(config);
    homing.begin(gcode::AxisSet{}.add(Axis::x));
    Homing::Order order = homing.order();
    EXPECT_EQ(order.phase, Phase::fast_approach);
    EXPECT_TRUE(order.approaches());
    EXPECT_LT(order.distance_mm, -150);
    EXPECT_EQ(order.speed_mm_s, 40);
    ASSERT_TRUE(homing.done(true));
    order = homing.order();
    EXPECT_EQ(order.phase, Phase::retreat);
    EXPECT_FALSE(order.approaches());
    EXPECT_EQ(order.distance_mm, 3);
    ASSERT_TRUE(homing.done(false));
    order = homing.order();
    EXPECT_EQ(order.phase, Phase::slow_approach);
    EXPECT_TRUE(order.approaches());
    EXPECT_EQ(order.speed_mm_s, 4);
    EXPECT_EQ(order.distance_mm, -6);
    ASSERT_TRUE(homing.done(true));
    EXPECT_EQ(homing.order().phase, Phase::settle);
    EXPECT_EQ(homing.order().distance_mm, 0);
    ASSERT_TRUE(homing.done(true));
    EXPECT_FALSE(homing.active());
}

TEST(Homing, AxesFollowOneAnotherXYZ) {
    MachineConfig config;
    Homing homing(config);
    homing.begin(gcode::AxisSet::tool());
    for (Axis axis : gcode::kToolAxes) {
        for (int phase = 0; phase < 4; ++phase) {
            EXPECT_EQ(homing.order().axis, axis);
            ASSERT_TRUE(homing.done(true));
        }
    }
    EXPECT_FALSE(homing.active());
}

TEST(Homing, ASwitchThatIsNotReachedEndsIt) {
    MachineConfig config;
    Homing homing(config);
    homing.begin(gcode::AxisSet{}.add(Axis::y).add(Axis::z));
    EXPECT_EQ(homing.order().axis, Axis::y);
    EXPECT_FALSE(homing.done(false));
    EXPECT_FALSE(homing.active());
}

TEST(Homing, ASwitchAtTheMaximumIsApproachedUpwards) {
    MachineConfig config;
    config.axes[2].home_towards_minimum = false;
    Homing homing(config);
    homing.begin(gcode::AxisSet{}.add(Axis::z));
    EXPECT_GT(homing.order().distance_mm, 150);
    ASSERT_TRUE(homing.done(true));
    EXPECT_LT(homing.order().distance_mm, 0);
}

TEST(Homing, ADeltasTowersAreApproachedTogetherWhateverIsAsked) {
    MachineConfig config;
    config.kinematics.type = KinematicsType::delta;
    config.axes[Axis::z].home_towards_minimum = false;
    Homing homing(config);
    homing.begin(gcode::AxisSet{}.add(Axis::x));
    for (int phase = 0; phase < 4; ++phase) {
        EXPECT_EQ(homing.order().axis, Axis::z);
        EXPECT_EQ(homing.order().switches, gcode::AxisSet::tool());
        ASSERT_TRUE(homing.done(true));
    }
    EXPECT_FALSE(homing.active());
}

}  // namespace
}  // namespace qduino::printer::machine::homing_test
