#include <gtest/gtest.h>

#include "device/a4988.h"
#include "device/a4988_chip.h"

namespace qduino::device::a4988_test {
namespace {

constexpr Instant at(std::int64_t ns) { return instant_from_ns(ns); }

TEST(A4988, MicrostepTable) {
    EXPECT_EQ(a4988::microsteps(false, false, false), 1);
    EXPECT_EQ(a4988::microsteps(true, false, false), 2);
    EXPECT_EQ(a4988::microsteps(false, true, false), 4);
    EXPECT_EQ(a4988::microsteps(true, true, false), 8);
    EXPECT_EQ(a4988::microsteps(true, true, true), 16);
    EXPECT_FALSE(a4988::microsteps(false, false, true));
}

TEST(A4988Chip, AProperPulseIsOneMicrostepAtItsRisingEdge) {
    A4988Chip chip;
    chip.write_direction(at(0), true);
    EXPECT_FALSE(chip.write_step(at(200), true));
    const auto step = chip.write_step(at(1200), false);
    ASSERT_TRUE(step);
    EXPECT_EQ(step->at, at(200));
    EXPECT_TRUE(step->direction_high);
    EXPECT_EQ(chip.violations().total(), 0u);
}

TEST(A4988Chip, ExactlyTheMinimumIsEnoughAndOneNanosecondLessIsNot) {
    A4988Chip chip;
    EXPECT_FALSE(chip.write_step(at(10'000), true));
    EXPECT_FALSE(chip.write_step(at(10'999), false));  // 999 ns high
    EXPECT_EQ(chip.violations().step_high_short, 1u);
    EXPECT_FALSE(chip.write_step(at(11'998), true));  // 999 ns low
    EXPECT_FALSE(chip.write_step(at(12'998), false));
    EXPECT_EQ(chip.violations().step_low_short, 1u);
    EXPECT_FALSE(chip.write_step(at(13'998), true));  // 1000 ns low, 1000 ns high
    EXPECT_TRUE(chip.write_step(at(14'998), false));
    EXPECT_EQ(chip.violations().total(), 2u);
    EXPECT_EQ(chip.broken_pulses(), 2u);
}

TEST(A4988Chip, DirectionNeedsSetUpAndHold) {
    A4988Chip chip;
    chip.write_direction(at(10'000), true);
    EXPECT_FALSE(chip.write_step(at(10'199), true));
    EXPECT_FALSE(chip.write_step(at(12'000), false));
    EXPECT_EQ(chip.violations().direction_setup_short, 1u);
    EXPECT_FALSE(chip.write_step(at(20'000), true));
    chip.write_direction(at(20'199), false);
    EXPECT_FALSE(chip.write_step(at(22'000), false));
    EXPECT_EQ(chip.violations().direction_hold_short, 1u);
    EXPECT_FALSE(chip.write_step(at(30'000), true));
    chip.write_direction(at(30'200), true);
    const auto step = chip.write_step(at(32'000), false);
    ASSERT_TRUE(step);
    EXPECT_FALSE(step->direction_high) << "the direction is that of the rising edge";
}

TEST(A4988Chip, RepeatedLevelsAreNoEdges) {
    A4988Chip chip;
    EXPECT_FALSE(chip.write_step(at(1000), true));
    EXPECT_FALSE(chip.write_step(at(1100), true));
    EXPECT_TRUE(chip.write_step(at(2000), false));
    EXPECT_FALSE(chip.write_step(at(2100), false));
    chip.write_direction(at(3000), false);  // already low: no change, so no set-up time runs
    EXPECT_FALSE(chip.write_step(at(3100), true));
    EXPECT_TRUE(chip.write_step(at(4100), false));
    EXPECT_EQ(chip.violations().total(), 0u);
}

TEST(A4988Chip, DisabledIgnoresSteps) {
    A4988Chip chip;
    chip.write_enable(true);
    EXPECT_FALSE(chip.write_step(at(1000), true));
    EXPECT_FALSE(chip.write_step(at(3000), false));
    EXPECT_EQ(chip.ignored_while_disabled(), 1u);
    chip.write_enable(false);
    EXPECT_FALSE(chip.write_step(at(5000), true));
    EXPECT_TRUE(chip.write_step(at(7000), false));
}

}  // namespace
}  // namespace qduino::device::a4988_test
