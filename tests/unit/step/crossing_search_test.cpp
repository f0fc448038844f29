// Crossings of random polynomials against a walk in a hundred thousand small steps.
#include "printer/step/crossing_search.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace qduino::printer::step::crossing_search_test {
namespace {

struct Found {
    double at_s = 0;
    int way = 0;
};

std::vector<Found> search(const Polynomial& steps, double end_s, std::int64_t& count) {
    CrossingSearch crossings;
    crossings.begin(steps, end_s);
    std::vector<Found> found;
    double at_s = 0;
    while (const int way = crossings.next(count, at_s)) found.push_back({at_s, way});
    return found;
}

std::vector<Found> walk(const Polynomial& steps, double end_s, std::int64_t count) {
    constexpr int kSteps = 100'000;
    std::vector<Found> found;
    for (int i = 1; i <= kSteps; ++i) {
        const double at_s = end_s * i / kSteps;
        const std::int64_t now = whole_steps(steps.value(at_s));
        for (; count != now; count += count < now ? 1 : -1) found.push_back({at_s, count < now ? 1 : -1});
    }
    return found;
}

void compare(const Polynomial& steps, double end_s) {
    std::int64_t count = whole_steps(steps.value(0));
    const std::vector<Found> expected = walk(steps, end_s, count);
    const std::vector<Found> found = search(steps, end_s, count);
    EXPECT_EQ(count, whole_steps(steps.value(end_s)));
    // The walk may step over a pair that touches a half-step and leaves it.
    if (found.size() != expected.size()) {
        EXPECT_GT(found.size(), expected.size());
        EXPECT_LE(found.size() - expected.size(), 2u);
        return;
    }
    for (std::size_t i = 0; i < found.size(); ++i) {
        EXPECT_EQ(found[i].way, expected[i].way);
        EXPECT_NEAR(found[i].at_s, expected[i].at_s, 1.5e-5 * end_s) << i;
    }
    double before_s = 0;
    for (const Found& each : found) {
        EXPECT_GE(each.at_s, before_s);
        before_s = each.at_s;
    }
}

TEST(CrossingSearch, FindsWhatASlowWalkFinds) {
    std::mt19937_64 random(3);
    for (int round = 0; round < 300; ++round) {
        SCOPED_TRACE(round);
        const double end_s = 0.02;
        Polynomial steps;
        double power = 1;
        const std::size_t degree = 1 + static_cast<std::size_t>(round) % 5;
        for (std::size_t i = 0; i <= degree; ++i, power *= end_s)
            steps.c[i] = std::uniform_real_distribution<double>(-40, 40)(random) / power;
        compare(steps, end_s);
        if (::testing::Test::HasFailure()) return;
    }
}

TEST(CrossingSearch, StandingOnAHalfStepIsNoCrossing) {
    std::int64_t count = 7;
    EXPECT_TRUE(search(Polynomial{{7.5}}, 1, count).empty());
    // From rest on the very half-step upwards: the step is at once, and once.
    const std::vector<Found> found = search(Polynomial{{7.5, 0, 90}}, 0.1, count);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].at_s, 0);
    EXPECT_EQ(count, 8);
}

TEST(CrossingSearch, ARoundingErrorBesideTheHalfStepMakesNoPair) {
    std::int64_t count = 8;  // the window before ended just above 7½
    EXPECT_TRUE(search(Polynomial{{7.5 - 1e-13, 1e-14}}, 1, count).empty());
    EXPECT_EQ(count, 8);
    EXPECT_EQ(search(Polynomial{{7.5 - 1e-13, 1}}, 1.2, count).size(), 1u);
    EXPECT_EQ(count, 9);
}

TEST(Polynomial, ShiftedCurvesAreTheSameCurve) {
    const Polynomial p{{1, -2, 3, -4, 5, -6}};
    for (const double by : {-0.7, 0.0, 1.3}) {
        for (const double t : {-1.0, 0.4, 2.0}) {
            EXPECT_NEAR(p.shifted(by).value(t), p.value(t + by), 1e-9);
            EXPECT_NEAR(p.shifted(by).slope(t), p.slope(t + by), 1e-9);
        }
    }
    EXPECT_EQ(p.mirrored().value(0.5), p.value(-0.5));
    EXPECT_EQ(p.derivative().value(0.3), p.slope(0.3));
}

}  // namespace
}  // namespace qduino::printer::step::crossing_search_test
