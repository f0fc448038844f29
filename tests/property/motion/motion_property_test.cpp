// Properties of any list of moves, checked on 100 000 of every kind (random_moves.h).
#include <gtest/gtest.h>

#include <cmath>

#include "tests/property/motion/pipeline.h"
#include "tests/property/motion/random_moves.h"

namespace qduino::printer::motion_property_test {
namespace {

using motion::AxisVector;
using motion::Segment;
using step::EventKind;
using step::StepEvent;

constexpr AxisVector kStart{75, 75, 10, 0};

/// The reference machine, where only illegal pairs of steps are left out.
MachineConfig every_step() {
    MachineConfig config;
    config.reversal_gap = 2us;
    return config;
}

/// The speeds of all segments keep all limits and join; only the first and last stand still by
/// necessity.
void check_segments(const std::vector<Segment>& segments, const motion::MotionSettings& settings) {
    double speed = 0;
    std::int64_t ns = 0;
    AxisVector at = kStart;
    for (const Segment& segment : segments) {
        const motion::Trapezoid& shape = segment.shape;
        ASSERT_EQ(shape.entry_speed_mm_s, speed);
        ASSERT_EQ(segment.start.ns, ns);
        ASSERT_EQ(segment.start_mm, at);
        const double slack = 1e-9 * (1 + 2 * shape.acceleration_mm_s2 * shape.length_mm + speed * speed);
        ASSERT_LE(std::abs(std::pow(shape.exit_speed_mm_s, 2) - speed * speed),
                  2 * shape.acceleration_mm_s2 * shape.length_mm + slack);
        for (std::size_t i = 0; i < kAxisCount; ++i) {
            const double share = std::abs(segment.end_mm[i] - segment.start_mm[i]) / shape.length_mm;
            ASSERT_LE(shape.cruise_speed_mm_s * share, settings.max_speed[i].value() * (1 + 1e-9));
            ASSERT_LE(shape.entry_speed_mm_s * share, settings.max_speed[i].value() * (1 + 1e-9));
            ASSERT_LE(shape.acceleration_mm_s2 * share, settings.max_acceleration[i].value() * (1 + 1e-9));
        }
        speed = shape.exit_speed_mm_s;
        ns = segment.end.ns;
        at = segment.end_mm;
    }
    ASSERT_EQ(speed, 0);
}

/// Z and E never jump by more than they may where two segments meet.
void check_corners(const std::vector<Segment>& segments, const motion::MotionSettings& settings) {
    for (std::size_t n = 1; n < segments.size(); ++n) {
        const Segment &a = segments[n - 1], &b = segments[n];
        for (const std::size_t i : {2u, 3u}) {
            const double before = (a.end_mm[i] - a.start_mm[i]) / a.shape.length_mm;
            const double after = (b.end_mm[i] - b.start_mm[i]) / b.shape.length_mm;
            ASSERT_LE(std::abs(after - before) * b.shape.entry_speed_mm_s,
                      settings.instantaneous_speed[i].value() * (1 + 1e-6) + 1e-9);
        }
    }
}

/// Where each motor should be at a time on the time line, following the segments forward.
class Follower {
  public:
    explicit Follower(const std::vector<Segment>& segments) : segments_(segments) {}
    double axis_mm(std::size_t axis, std::int64_t ns) {
        while (at_ + 1 < segments_.size() && segments_[at_].end.ns < ns) ++at_;
        const Segment& segment = segments_[at_];
        const double s = segment.shape.distance_at(static_cast<double>(ns - segment.start.ns) * 1e-9);
        return segment.start_mm[axis] +
               (segment.end_mm[axis] - segment.start_mm[axis]) * s / segment.shape.length_mm;
    }

  private:
    const std::vector<Segment>& segments_;
    std::size_t at_ = 0;
};

void check_events(const test::Pipeline& pipeline, const MachineConfig& config,
                  std::array<std::int64_t, 4> counts) {
    Follower follower(pipeline.segments);
    std::int64_t before_ns = 0;
    std::array<std::int64_t, 4> last_ns;
    last_ns.fill(-1'000'000);
    for (const StepEvent& event : pipeline.events) {
        ASSERT_GE(event.time_ns, before_ns);
        before_ns = event.time_ns;
        if (event.kind != EventKind::step) continue;
        const std::size_t axis = event.axis;
        ASSERT_GE(event.time_ns - last_ns[axis], 2'000);
        last_ns[axis] = event.time_ns;
        const double steps = follower.axis_mm(axis, event.time_ns) * config.axes[axis].steps_per_mm;
        // Before and after the step the motor is half a step off, to within what a rounded
        // nanosecond or a dropped pair (2.4 µs at the speed of a corner) makes of it.
        ASSERT_NEAR(steps, static_cast<double>(counts[axis]) + 0.5 * event.direction, 0.02)
            << "axis " << axis;
        counts[axis] += event.direction;
    }
    ASSERT_EQ(counts, pipeline.solver.counts());
}

void check_seed(std::uint64_t seed, std::size_t count, const MachineConfig& config) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    test::RandomMoves random(seed, kStart);
    test::Pipeline pipeline(config, kStart);
    const std::array<std::int64_t, 4> start_counts = pipeline.solver.counts();
    for (const motion::Move& move : random.take(count)) pipeline.append(move);
    pipeline.finish();
    check_segments(pipeline.segments, pipeline.planner->settings());
    if (::testing::Test::HasFatalFailure()) return;
    check_corners(pipeline.segments, pipeline.planner->settings());
    if (::testing::Test::HasFatalFailure()) return;
    check_events(pipeline, config, start_counts);
    if (::testing::Test::HasFatalFailure()) return;
    const AxisVector& end = pipeline.planner->position_mm();
    for (std::size_t i = 0; i < kAxisCount; ++i) {
        ASSERT_EQ(pipeline.solver.counts()[i],
                  static_cast<std::int64_t>(std::floor(end[i] * config.axes[i].steps_per_mm + 0.5)));
    }
}

TEST(MotionProperty, AllRulesHoldForRandomMoves) {
    for (std::uint64_t seed = 1; seed <= 100; ++seed) {
        check_seed(seed, 1000, every_step());
        if (HasFatalFailure()) return;
    }
}

TEST(MotionProperty, AllRulesHoldWhereReversalsAreViolent) {
    MachineConfig config = every_step();
    for (AxisConfig& axis : config.axes) {
        axis.max_acceleration = 50'000_mm_s2;
        axis.instantaneous_speed = 40_mm_s;
        axis.max_speed = 200_mm_s;
    }
    for (std::uint64_t seed = 201; seed <= 220; ++seed) {
        check_seed(seed, 1000, config);
        if (HasFatalFailure()) return;
    }
}

// When next() is called makes no difference, only when flush() is.
TEST(MotionProperty, PlanningDoesNotDependOnWhenSegmentsAreTaken) {
    for (std::uint64_t seed = 301; seed <= 310; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        test::Pipeline eager(MachineConfig{}, kStart), lazy(MachineConfig{}, kStart);
        test::RandomMoves random(seed, kStart);
        for (const motion::Move& move : random.take(3000)) {
            eager.append(move);
            eager.pump();
            lazy.append(move);
        }
        eager.finish();
        lazy.finish();
        ASSERT_EQ(eager.events.size(), lazy.events.size());
        for (std::size_t i = 0; i < eager.events.size(); ++i) {
            ASSERT_EQ(eager.events[i].time_ns, lazy.events[i].time_ns) << i;
            ASSERT_EQ(eager.events[i].axis, lazy.events[i].axis) << i;
        }
    }
}

// Held and resumed at random, the machine still goes everywhere it was sent, within all limits.
TEST(MotionProperty, HoldingAtRandomChangesTimesButNoSteps) {
    for (std::uint64_t seed = 401; seed <= 420; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        test::RandomMoves random(seed, kStart);
        test::Pipeline pipeline(every_step(), kStart);
        const auto start_counts = pipeline.solver.counts();
        for (const motion::Move& move : random.take(1000)) {
            pipeline.append(move);
            if (random.choice(50) != 0) continue;
            pipeline.pump();
            pipeline.planner->hold();
            pipeline.pump();
            ASSERT_TRUE(pipeline.planner->stopped());
            ASSERT_TRUE(pipeline.planner->resting());
            pipeline.planner->resume();
        }
        pipeline.finish();
        check_segments(pipeline.segments, pipeline.planner->settings());
        if (HasFatalFailure()) return;
        check_events(pipeline, every_step(), start_counts);
        if (HasFatalFailure()) return;
    }
}

}  // namespace
}  // namespace qduino::printer::motion_property_test
