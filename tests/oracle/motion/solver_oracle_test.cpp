// The step solver against bisection. The oracle writes the position of a motor as a function of
// time, from entry speed, acceleration and phase times alone, and searches for each crossing of a
// half-step by halving.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/property/motion/pipeline.h"
#include "tests/property/motion/random_moves.h"

namespace qduino::printer::step::solver_oracle_test {
namespace {

using motion::AxisVector;
using motion::Segment;
using Real = long double;

Real distance_after(const motion::Trapezoid& shape, Real t) {
    const Real a = shape.acceleration_mm_s2, v0 = shape.entry_speed_mm_s, vc = shape.cruise_speed_mm_s;
    const Real t1 = std::min<Real>(t, shape.accelerate_s);
    const Real t2 = std::clamp<Real>(t - shape.accelerate_s, 0, shape.cruise_s);
    const Real t3 = std::clamp<Real>(t - shape.accelerate_s - shape.cruise_s, 0, shape.decelerate_s);
    return v0 * t1 + a * t1 * t1 / 2 + vc * t2 + vc * t3 - a * t3 * t3 / 2;
}

Real motor_steps_after(const Segment& segment, std::size_t axis, Real steps_per_mm, Real t) {
    const Real part = distance_after(segment.shape, t) / segment.shape.length_mm;
    return steps_per_mm * (segment.start_mm[axis] +
                           part * (static_cast<Real>(segment.end_mm[axis]) - segment.start_mm[axis]));
}

/// Time within the segment at which the motor crosses `steps`.
Real bisect(const Segment& segment, std::size_t axis, Real steps_per_mm, Real steps) {
    const bool rising = segment.end_mm[axis] > segment.start_mm[axis];
    Real low = 0, high = segment.shape.duration_s();
    for (int i = 0; i < 70; ++i) {
        const Real middle = (low + high) / 2;
        const bool behind = (motor_steps_after(segment, axis, steps_per_mm, middle) < steps) == rising;
        (behind ? low : high) = middle;
    }
    return (low + high) / 2;
}

struct Expected {
    Real ns;
    int direction;
};

/// All crossings of one axis over all segments, reversals included, however near.
std::vector<Expected> crossings(const std::vector<Segment>& segments, std::size_t axis, double steps_per_mm,
                                double start_mm) {
    std::vector<Expected> found;
    std::int64_t count = static_cast<std::int64_t>(std::floor(start_mm * steps_per_mm + 0.5));
    for (const Segment& segment : segments) {
        const auto target = static_cast<std::int64_t>(std::floor(segment.end_mm[axis] * steps_per_mm + 0.5));
        const int direction = target > count ? 1 : -1;
        for (; count != target; count += direction) {
            const Real crossing = static_cast<Real>(count) + Real(direction) / 2;
            const Real t = bisect(segment, axis, steps_per_mm, crossing);
            found.push_back(
                {static_cast<Real>(segment.start.ns) + segment.start.fraction_ns + t * 1e9L, direction});
        }
    }
    return found;
}

/// Takes out pairs there and back that are nearer than `gap_ns`, as the solver says it does.
std::vector<Expected> without_pairs(const std::vector<Expected>& all, std::int64_t gap_ns) {
    std::vector<Expected> kept;
    bool may_pair = false;
    for (const Expected& step : all) {
        if (may_pair && kept.back().direction != step.direction &&
            step.ns - kept.back().ns < static_cast<Real>(gap_ns)) {
            kept.pop_back();
            may_pair = !kept.empty();
            continue;
        }
        kept.push_back(step);
        may_pair = true;
    }
    return kept;
}

void check(std::uint64_t seed, std::size_t count, const MachineConfig& config) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const AxisVector start{75, 75, 10, 0};
    test::RandomMoves random(seed, start);
    test::Pipeline pipeline(config, start);
    for (const motion::Move& move : random.take(count)) pipeline.append(move);
    pipeline.finish();
    for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
        const double steps_per_mm = config.axes[axis].steps_per_mm;
        const auto expected =
            without_pairs(crossings(pipeline.segments, axis, steps_per_mm, start[axis]), 2'000);
        std::size_t at = 0;
        for (const StepEvent& event : pipeline.events) {
            if (event.kind != EventKind::step || event.axis != axis) continue;
            ASSERT_LT(at, expected.size());
            ASSERT_EQ(event.direction, expected[at].direction) << "axis " << axis << " step " << at;
            ASSERT_NEAR(static_cast<double>(static_cast<Real>(event.time_ns) - expected[at].ns), 0, 1'000)
                << "axis " << axis << " step " << at;
            ++at;
        }
        ASSERT_EQ(at, expected.size());
    }
}

/// The reference machine, where only illegal pairs are left out.
MachineConfig near_gap() {
    MachineConfig config;
    config.reversal_gap = 2us;
    return config;
}

TEST(SolverOracle, EveryStepIsWithinAMicrosecondOfBisection) {
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
        check(seed, 40, near_gap());
        if (HasFatalFailure()) return;
    }
}

TEST(SolverOracle, TheSameOnAFastMachineWithFineSteps) {
    MachineConfig config = near_gap();
    for (int i = 0; i < 2; ++i) {
        config.axes[i].steps_per_mm = 160;
        config.axes[i].max_speed = 400_mm_s;
        config.axes[i].max_acceleration = 9000_mm_s2;
    }
    config.axes[2].max_speed = 20_mm_s;
    config.axes[2].max_acceleration = 200_mm_s2;
    config.axes[3].max_speed = 80_mm_s;
    for (std::uint64_t seed = 101; seed <= 110; ++seed) {
        check(seed, 40, config);
        if (HasFatalFailure()) return;
    }
}

}  // namespace
}  // namespace qduino::printer::step::solver_oracle_test
