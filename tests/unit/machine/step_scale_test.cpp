#include "printer/machine/step_scale.h"

#include <gtest/gtest.h>

namespace qduino::printer::machine::step_scale_test {
namespace {

TEST(StepScale, AtPowerUpEachAxisIsTakenToStandAtItsHome) {
    MachineConfig config;
    config.axes[Axis::y].home_position = Millimetres{150};
    StepScale scale(config);
    const motion::AxisVector at = scale.position_of({});
    EXPECT_EQ(at, (motion::AxisVector{0, 150, 0, 0}));
    EXPECT_EQ(scale.origin()[1], -12000);
}

TEST(StepScale, HomingDefinesWhereAnAxisIs) {
    StepScale scale{MachineConfig{}};
    scale.define(gcode::AxisSet{}.add(Axis::x), {1000, 0, 0, 0}, {0, 7, 7, 7});
    scale.define(gcode::AxisSet{}.add(Axis::z), {1000, 0, -5, 0}, {7, 7, 0.5, 7});
    const motion::AxisVector at = scale.position_of({1080, 160, -5, 0});
    EXPECT_EQ(at, (motion::AxisVector{1, 2, 0.5, 0}));
}

TEST(StepScale, TwoBeltsAreHomedAlongOneAxisAndTheOtherStands) {
    MachineConfig config;
    config.kinematics.type = KinematicsType::corexy;
    config.axes[Axis::x].home_position = Millimetres{3};
    StepScale scale(config);
    EXPECT_EQ(scale.position_of({}), (motion::AxisVector{3, 0, 0, 0}));
    // 160 steps along X and 80 along Y, and then X is found to be at home.
    scale.define(gcode::AxisSet{}.add(Axis::x), {240, 80, 0, 0}, {3, 99, 99, 0});
    EXPECT_EQ(scale.position_of({240, 80, 0, 0}), (motion::AxisVector{3, 1, 0, 0}));
    // An odd step between the belts: both are half a step off, and Y is not.
    scale.define(gcode::AxisSet{}.add(Axis::x), {241, 80, 0, 0}, {3, 99, 99, 0});
    const motion::AxisVector at = scale.position_of({241, 80, 0, 0});
    EXPECT_NEAR(at[0], 3, 0.5 / 80 + 1e-12);
    EXPECT_DOUBLE_EQ(at[1], 1 + 0.5 / 80);
}

TEST(StepScale, ADeltasCarriagesAreHomedTogether) {
    MachineConfig config;
    config.kinematics = {.type = KinematicsType::delta,
                         .delta_radius = Millimetres{105},
                         .arm_length = Millimetres{215},
                         .home_height = Millimetres{250}};
    place_delta_home(config);
    StepScale scale(config);
    const StepCounts found{1234, -77, 5, 0};
    scale.define(gcode::AxisSet::tool(), found, {0, 0, 250, 0});
    const motion::AxisVector at = scale.position_of(found);
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(at[i], i == 2 ? 250 : 0, 0.02);
}

TEST(StepScale, WhatIsLeftOfAStepIsKeptOnAnAxisWithAMotorOfItsOwn) {
    MachineConfig config;
    const StepScale scale(config);
    const motion::AxisVector planned{50, 63.406, 0, 1.003};  // 5072.48 steps of Y, 96.29 of E
    const motion::AxisVector at = scale.position_of({0, 5072, 0, 96}, planned);
    EXPECT_EQ(at, (motion::AxisVector{0, 63.406, 0, 1.003})) << "X stands elsewhere";
    EXPECT_EQ(scale.position_of({0, 5073, 0, 97}, planned), scale.position_of({0, 5073, 0, 97}));
    config.kinematics.type = KinematicsType::corexy;
    const StepScale belts(config);
    EXPECT_EQ(belts.position_of({5072, -5072, 0, 96}, {0, 63.406, 0, 1.003})[1], 63.4) << "two motors";
}

TEST(StepScale, SkippedStepsCountForNothing) {
    StepScale scale{MachineConfig{}};
    scale.skip(Axis::e, 960);
    EXPECT_EQ(scale.position_of({0, 0, 0, 1056})[3], 1);
    EXPECT_EQ(scale.length_of(Axis::e, -96), 1) << "a length has no sign";
}

}  // namespace
}  // namespace qduino::printer::machine::step_scale_test
