#include "device/endstop.h"

#include <gtest/gtest.h>

namespace qduino::device {
namespace {

constexpr Instant ms(double milliseconds) { return kEpoch + from_seconds(milliseconds * 1e-3); }

TEST(Endstop, WithoutSteadyTimeItIsTheContact) {
    Endstop endstop;
    EXPECT_FALSE(endstop.sample(ms(0), false));
    EXPECT_TRUE(endstop.sample(ms(1), true));
    EXPECT_FALSE(endstop.sample(ms(2), false));
}

TEST(Endstop, ABounceIsNotBelieved) {
    Endstop endstop(2ms);
    EXPECT_FALSE(endstop.sample(ms(0), true));
    EXPECT_FALSE(endstop.sample(ms(1.9), true));
    EXPECT_FALSE(endstop.sample(ms(1.95), false));
    EXPECT_FALSE(endstop.sample(ms(2.0), true));
    EXPECT_FALSE(endstop.sample(ms(3.9), true));
    EXPECT_TRUE(endstop.sample(ms(4.0), true));
    EXPECT_TRUE(endstop.sample(ms(5.0), false));
    EXPECT_TRUE(endstop.sample(ms(6.9), false));
    EXPECT_FALSE(endstop.sample(ms(7.0), false));
}

}  // namespace
}  // namespace qduino::device
