#include "printer/motion/s_curve.h"

#include <gtest/gtest.h>

#include <random>

namespace qduino::printer::motion::s_curve_test {
namespace {

/// The way and the speed after a change of speed, by stepping through it in small steps of time:
/// the acceleration grows while what it needs to come to 0 again still fits.
struct Stepped {
    double mm = 0, speed = 0, seconds = 0, acceleration_max = 0;
};
Stepped step_through(double from, double to, double a, double j) {
    constexpr double kStep_s = 1e-6;
    Stepped at{.speed = from};
    double acceleration = 0;
    while (at.speed < to && at.seconds < 10) {
        // Letting go from here gains a²/2j more.
        const bool lets_go = to - at.speed <= acceleration * acceleration / (2 * j);
        acceleration = lets_go ? acceleration - j * kStep_s : std::min(acceleration + j * kStep_s, a);
        if (acceleration <= 0) break;
        at.mm += at.speed * kStep_s;
        at.speed += acceleration * kStep_s;
        at.seconds += kStep_s;
        at.acceleration_max = std::max(at.acceleration_max, acceleration);
    }
    return at;
}

TEST(SCurve, RampsAreThoseOfASteppedIntegration) {
    std::mt19937_64 random(7);
    const auto pick = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
    };
    for (int i = 0; i < 60; ++i) {
        const double from = pick(0, 100), to = from + pick(1, 150), a = pick(500, 5000), j = pick(2e4, 5e5);
        const Stepped stepped = step_through(from, to, a, j);
        EXPECT_NEAR(ramp_mm(from, to, a, j), stepped.mm, 0.02 * stepped.mm + 2e-3) << i;
        EXPECT_NEAR(speed_ramp(to - from, a, j).duration_s(), stepped.seconds, 0.02 * stepped.seconds + 1e-4)
            << i;
        EXPECT_LE(stepped.acceleration_max, a);
    }
}

TEST(SCurve, ReachIsTheInverseOfTheRamp) {
    std::mt19937_64 random(8);
    const auto pick = [&](double low, double high) {
        return std::pow(10, std::uniform_real_distribution<double>(low, high)(random));
    };
    for (int i = 0; i < 10'000; ++i) {
        const double from = i % 10 == 0 ? 0 : pick(-3, 2.5), length = pick(-3, 2), a = pick(1, 4.5),
                     j = pick(3, 7);
        const double to = speed_after_ramp(from, length, a, j);
        ASSERT_GE(to, from);
        ASSERT_NEAR(ramp_mm(from, to, a, j), length, 1e-5 * length + 1e-7) << from << ' ' << a << ' ' << j;
    }
}

TEST(SCurve, ProfilesFillTheirLengthAndKeepTheirSpeeds) {
    std::mt19937_64 random(9);
    const auto pick = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
    };
    for (int i = 0; i < 2000; ++i) {
        const double length = std::pow(10, pick(-3, 2)), top = pick(1, 200), a = pick(100, 5000),
                     j = pick(1e4, 1e6);
        const double entry = pick(0, top);
        const double exit = std::min(pick(0, top), speed_after_ramp(entry, length, a, j));
        if (speed_after_ramp(exit, length, a, j) < entry) continue;
        const Trapezoid shape = make_s_curve(length, entry, top, exit, a, j);
        ASSERT_LE(shape.cruise_speed_mm_s, top * (1 + 1e-12));
        ASSERT_GE(shape.cruise_speed_mm_s, std::max(entry, exit));
        const double filled = 0.5 * (entry + shape.cruise_speed_mm_s) * shape.accelerate_s +
                              shape.cruise_speed_mm_s * shape.cruise_s +
                              0.5 * (exit + shape.cruise_speed_mm_s) * shape.decelerate_s;
        ASSERT_NEAR(filled, length, 1e-9 * length + 1e-10) << i;
        // Nothing is wasted: without a cruise at full speed there is no cruise at all.
        if (shape.cruise_speed_mm_s < top * (1 - 1e-9)) {
            ASSERT_LE(shape.cruise_s, 1e-6);
        }
    }
}

}  // namespace
}  // namespace qduino::printer::motion::s_curve_test
