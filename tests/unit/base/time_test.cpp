#include "base/time.h"

#include <gtest/gtest.h>

#include <type_traits>

namespace qduino::time_test {
namespace {

template <typename C>
concept HasNow = requires {
    C::now();
};
static_assert(!HasNow<Clock>, "only a board hands out the time");
static_assert(std::is_same_v<decltype(Instant{} - Instant{}), Nanoseconds>);
static_assert(std::is_convertible_v<std::chrono::milliseconds, Nanoseconds>);
static_assert(!std::is_convertible_v<std::int64_t, Instant>, "a bare number is not an instant");

TEST(Time, NanosecondsAreExact) {
    EXPECT_EQ(to_ns(instant_from_ns(123) + 1us), 1123);
    EXPECT_EQ(to_ns(kEpoch), 0);
    EXPECT_LT(instant_from_ns(INT64_MAX - 1), kForever);
    EXPECT_EQ(to_ns(Nanoseconds{5ms}), 5'000'000);
}

TEST(Time, SecondsRoundToTheNearestNanosecond) {
    EXPECT_EQ(from_seconds(1.5), 1500ms);
    EXPECT_EQ(from_seconds(1e-9 * 0.6), 1ns);
    EXPECT_EQ(from_seconds(-1e-9 * 0.6), -1ns);
    EXPECT_EQ(from_seconds(-1e-9 * 0.4), 0ns);
    EXPECT_DOUBLE_EQ(to_seconds(250ms), 0.25);
}

}  // namespace
}  // namespace qduino::time_test
