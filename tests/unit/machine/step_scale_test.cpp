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
    scale.define(Axis::x, 1000, 0);
    scale.define(Axis::z, -5, 0.5);
    const motion::AxisVector at = scale.position_of({1080, 160, -5, 0});
    EXPECT_EQ(at, (motion::AxisVector{1, 2, 0.5, 0}));
}

TEST(StepScale, SkippedStepsCountForNothing) {
    StepScale scale{MachineConfig{}};
    scale.skip(Axis::e, 960);
    EXPECT_EQ(scale.position_of({0, 0, 0, 1056})[3], 1);
    EXPECT_EQ(scale.length_of(Axis::e, -96), 1) << "a length has no sign";
}

}  // namespace
}  // namespace qduino::printer::machine::step_scale_test
