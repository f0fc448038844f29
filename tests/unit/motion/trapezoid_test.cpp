#include "printer/motion/trapezoid.h"

#include <gtest/gtest.h>

#include <random>

namespace qduino::printer::motion::trapezoid_test {
namespace {

TEST(Trapezoid, FullProfileFromRestToRest) {
    const Trapezoid shape = make_trapezoid(100, 0, 200, 0, 3000);
    EXPECT_DOUBLE_EQ(shape.cruise_speed_mm_s, 200);
    EXPECT_DOUBLE_EQ(shape.accelerate_mm, 200.0 * 200 / 6000);
    EXPECT_DOUBLE_EQ(shape.accelerate_s, 200.0 / 3000);
    EXPECT_DOUBLE_EQ(shape.decelerate_s, 200.0 / 3000);
    EXPECT_DOUBLE_EQ(shape.cruise_s, (100 - 2 * 200.0 * 200 / 6000) / 200);
}

TEST(Trapezoid, TriangleWhenThereIsNoRoom) {
    const Trapezoid shape = make_trapezoid(1, 0, 200, 0, 1000);
    EXPECT_DOUBLE_EQ(shape.cruise_speed_mm_s, std::sqrt(1000.0));
    EXPECT_NEAR(shape.cruise_s, 0, 1e-12);
    EXPECT_NEAR(shape.duration_s(), 2 * std::sqrt(1.0 / 1000), 1e-12);
}

TEST(Trapezoid, ConstantSpeedHasNoRamps) {
    const Trapezoid shape = make_trapezoid(10, 50, 50, 50, 1000);
    EXPECT_EQ(shape.accelerate_s, 0);
    EXPECT_EQ(shape.decelerate_s, 0);
    EXPECT_DOUBLE_EQ(shape.duration_s(), 0.2);
    EXPECT_DOUBLE_EQ(shape.time_at(5), 0.1);
}

TEST(Trapezoid, EndsMapToEnds) {
    const Trapezoid shape = make_trapezoid(3, 10, 80, 5, 2000);
    EXPECT_EQ(shape.time_at(0), 0);
    EXPECT_DOUBLE_EQ(shape.time_at(3), shape.duration_s());
    EXPECT_EQ(shape.time_at(-1), 0);
    EXPECT_DOUBLE_EQ(shape.time_at(4), shape.duration_s());
    EXPECT_EQ(shape.distance_at(-1), 0);
    EXPECT_DOUBLE_EQ(shape.distance_at(10), 3);
}

TEST(Trapezoid, ExactDownToStandstill) {
    const Trapezoid shape = make_trapezoid(100, 0, 200, 0, 30);
    for (const double distance : {1e-15, 1e-12, 1e-9, 1e-6}) {
        EXPECT_NEAR(shape.time_at(distance) / std::sqrt(2 * distance / 30), 1, 1e-12) << distance;
    }
}

// Whatever the speeds: time_at inverts distance_at, both rise, the phases meet, and their areas add
// up to the length.
TEST(Trapezoid, TimeAndDistanceAreInverse) {
    std::mt19937_64 random(11);
    const auto uniform = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
    };
    for (int round = 0; round < 20'000; ++round) {
        const double length = std::pow(10, uniform(-6, 2)), acceleration = uniform(10, 10'000),
                     top = uniform(1, 300);
        const double entry = uniform(0, 1) < 0.3 ? 0 : uniform(0, top);
        const double reach2 = 2 * acceleration * length;
        const double low = std::sqrt(std::max(0.0, entry * entry - reach2));
        const double exit = uniform(low, std::min(top, std::sqrt(entry * entry + reach2)));
        const Trapezoid shape = make_trapezoid(length, entry, top, exit, acceleration);
        ASSERT_LE(shape.cruise_speed_mm_s, top * (1 + 1e-12));
        const double area = 0.5 * (entry + shape.cruise_speed_mm_s) * shape.accelerate_s +
                            shape.cruise_speed_mm_s * shape.cruise_s +
                            0.5 * (exit + shape.cruise_speed_mm_s) * shape.decelerate_s;
        ASSERT_NEAR(area / length, 1, 1e-9);
        double before_s = 0;
        for (int i = 0; i <= 20; ++i) {
            const double time = shape.duration_s() * i / 20;
            const double distance = shape.distance_at(time);
            ASSERT_NEAR(shape.distance_at(shape.time_at(distance)), distance, 1e-9 * length) << round;
            ASSERT_GE(shape.time_at(distance), before_s - 1e-12);
            before_s = shape.time_at(distance);
        }
    }
}

}  // namespace
}  // namespace qduino::printer::motion::trapezoid_test
