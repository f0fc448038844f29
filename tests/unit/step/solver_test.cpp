#include "printer/step/solver.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/property/motion/pipeline.h"

namespace qduino::printer::step::solver_test {
namespace {

using motion::Move;
using test::Pipeline;

Move to(double x, double y, double z = 0, double e = 0, double speed = 100, double acceleration = 3000) {
    return {{x, y, z}, e, speed, acceleration};
}

std::vector<StepEvent> steps_of(const std::vector<StepEvent>& events, Axis axis) {
    std::vector<StepEvent> steps;
    for (const StepEvent& event : events) {
        if (event.kind == EventKind::step && event.axis == static_cast<int>(axis)) steps.push_back(event);
    }
    return steps;
}

std::vector<EventKind> kinds_of(const std::vector<StepEvent>& events) {
    std::vector<EventKind> kinds;
    for (const StepEvent& event : events) {
        if (kinds.empty() || event.kind != EventKind::step || kinds.back() != EventKind::step) {
            kinds.push_back(event.kind);
        }
    }
    return kinds;
}

/// When a motor that goes `length` mm from rest to rest has covered `distance`.
double analytic_trapezoid_s(double distance, double length, double speed, double acceleration) {
    const double ramp_s = speed / acceleration, ramp = 0.5 * acceleration * ramp_s * ramp_s;
    const double total_s = 2 * ramp_s + (length - 2 * ramp) / speed;
    if (distance < ramp) return std::sqrt(2 * distance / acceleration);
    if (distance <= length - ramp) return ramp_s + (distance - ramp) / speed;
    return total_s - std::sqrt(2 * (length - distance) / acceleration);
}

// The case of the acceptance list: 100 mm of X at 200 mm/s, 3000 mm/s², 80 steps/mm.
TEST(Solver, EveryStepOfThe100MmMoveIsWhereTheTrapezoidHasIt) {
    MachineConfig config;
    config.axes[0].max_speed = 200_mm_s;
    config.axes[0].max_acceleration = 3000_mm_s2;
    Pipeline pipeline(config);
    pipeline.append(to(100, 0, 0, 0, 200, 3000));
    pipeline.finish();
    const auto steps = steps_of(pipeline.events, Axis::x);
    ASSERT_EQ(steps.size(), 8000u);
    for (std::size_t k = 0; k < steps.size(); ++k) {
        const double exact_ns =
            1e9 * analytic_trapezoid_s((static_cast<double>(k) + 0.5) / 80, 100, 200, 3000);
        ASSERT_NEAR(static_cast<double>(steps[k].time_ns), exact_ns, 1.0) << "step " << k;
        ASSERT_EQ(steps[k].direction, 1);
    }
}

TEST(Solver, AVerySlowAxisIsSolvedAsExactly) {
    Pipeline pipeline{MachineConfig{}};
    pipeline.append(to(0, 0, 10, 0, 5, 3000));
    pipeline.finish();
    const auto steps = steps_of(pipeline.events, Axis::z);
    ASSERT_EQ(steps.size(), 20'200u);
    for (std::size_t k = 0; k < steps.size(); ++k) {
        const double exact_ns = 1e9 * analytic_trapezoid_s((static_cast<double>(k) + 0.5) / 2020, 10, 5, 30);
        ASSERT_NEAR(static_cast<double>(steps[k].time_ns), exact_ns, 2.0) << "step " << k;
    }
}

TEST(Solver, EachAxisIsSolvedByItself) {
    Pipeline pipeline{MachineConfig{}};
    pipeline.append(to(10, 3, 0, 0.7, 60, 1000));
    pipeline.finish();
    EXPECT_EQ(pipeline.solver.counts(), (std::array<std::int64_t, 4>{800, 240, 0, 67}));
    const double length = std::sqrt(109.0);
    for (const auto& [axis, travel, per_mm] :
         {std::tuple{Axis::x, 10.0, 80.0}, {Axis::y, 3.0, 80.0}, {Axis::e, 0.7, 96.0}}) {
        const auto steps = steps_of(pipeline.events, axis);
        for (std::size_t k = 0; k < steps.size(); ++k) {
            const double distance = (static_cast<double>(k) + 0.5) / per_mm / travel * length;
            ASSERT_NEAR(static_cast<double>(steps[k].time_ns),
                        1e9 * analytic_trapezoid_s(distance, length, 60, 1000), 2.0);
        }
    }
}

TEST(Solver, EventsComeInOrderOfTimeAndTiesInOrderOfAxis) {
    Pipeline pipeline{MachineConfig{}};
    pipeline.append(to(20, 20, 0, 0));
    pipeline.finish();
    std::int64_t before_ns = 0;
    int before_axis = 1;
    for (const StepEvent& event : pipeline.events) {
        if (event.kind != EventKind::step) continue;
        ASSERT_GE(event.time_ns, before_ns);
        ASSERT_NE(event.axis, before_axis);  // on the diagonal X and Y always tie
        ASSERT_EQ(event.axis == 1, event.time_ns == before_ns);
        before_ns = event.time_ns;
        before_axis = event.axis;
    }
}

TEST(Solver, TheBudgetChangesNothingButThePortions) {
    std::vector<StepEvent> expected;
    for (const std::size_t portion : {~std::size_t{0}, std::size_t{1}, std::size_t{7}}) {
        Pipeline pipeline{MachineConfig{}};
        pipeline.portion = portion;
        for (int i = 0; i < 50; ++i) ASSERT_TRUE(pipeline.planner->append(to(i % 2, i * 0.3, 0, 0.01)));
        pipeline.finish();
        ASSERT_LE(pipeline.most_given, portion);
        if (expected.empty()) expected = pipeline.events;
        ASSERT_EQ(pipeline.events.size(), expected.size());
        ASSERT_EQ(test::first_difference(pipeline.events, expected), expected.size());
    }
}

TEST(Solver, RestIsToldWhenTheMotionStandsStillAndOnlyThen) {
    Pipeline pipeline{MachineConfig{}};
    pipeline.append(to(10, 0));
    pipeline.append(to(20, 0));
    ASSERT_TRUE(pipeline.planner->append_dwell(0.1));
    pipeline.append(to(30, 0));
    pipeline.finish();
    EXPECT_EQ(kinds_of(pipeline.events), (std::vector{EventKind::step, EventKind::rest, EventKind::rest,
                                                      EventKind::step, EventKind::rest}));
    // The end of the dwell.
    EXPECT_EQ(pipeline.events[1601].time_ns, pipeline.segments[2].end.ns_after(0));
    EXPECT_EQ(pipeline.events.back().time_ns, pipeline.segments.back().end.ns_after(0));
}

TEST(Solver, MarkersComeBehindTheStepsBeforeThem) {
    Pipeline pipeline{MachineConfig{}};
    pipeline.append(to(10, 0));
    ASSERT_TRUE(pipeline.planner->append_marker(42));
    pipeline.append(to(20, 0));
    pipeline.finish();
    std::size_t steps = 0;
    for (const StepEvent& event : pipeline.events) {
        if (event.kind == EventKind::marker) {
            EXPECT_EQ(event.value, 42u);
            EXPECT_EQ(steps, 800u);
        }
        steps += event.kind == EventKind::step;
    }
    EXPECT_EQ(steps, 1600u);
}

TEST(Solver, HomingSwitchesKeepTheirPlace) {
    Pipeline pipeline{MachineConfig{}, {10, 0, 0, 0}};
    EXPECT_EQ(pipeline.solver.counts()[0], 800);
    ASSERT_TRUE(pipeline.planner->append_homing(Axis::x, motor_bit(Axis::x)));
    pipeline.append(to(-10, 0));
    ASSERT_TRUE(pipeline.planner->append_homing(Axis::x, 0));
    pipeline.append(to(-9, 0));
    pipeline.finish();
    EXPECT_EQ(kinds_of(pipeline.events), (std::vector{EventKind::homing, EventKind::step, EventKind::rest,
                                                      EventKind::homing, EventKind::step, EventKind::rest}));
    EXPECT_EQ(pipeline.solver.counts()[0], -720);
}

// Z at 0.025 mm stands exactly on the half-step 50½ (2020 steps/mm): up takes the step in the last
// instant, down takes it back in the first.
TEST(Solver, AHalfStepTouchedAndLeftAgainMakesNoPairOfPulses) {
    Pipeline pipeline{MachineConfig{}};
    pipeline.append(to(0, 0, 0.025, 0, 5));
    pipeline.append(to(0, 0, 0, 0, 5));
    pipeline.append(to(0, 0, 0.025, 0, 5));
    pipeline.append(to(0, 0, 0.05, 0, 5));
    pipeline.finish();
    const auto steps = steps_of(pipeline.events, Axis::z);
    EXPECT_EQ(pipeline.solver.pairs_dropped(), 1u);
    EXPECT_EQ(pipeline.solver.steps_delayed(), 0u);
    EXPECT_EQ(steps.size(), 50u + 50u + 101u);
    std::int64_t at = 0;
    for (std::size_t i = 1; i < steps.size(); ++i) {
        at += steps[i].direction;
        ASSERT_GE(steps[i].time_ns - steps[i - 1].time_ns, 2'000);
    }
    EXPECT_EQ(at + steps[0].direction, 101);
}

TEST(Solver, ThePairIsDelayedWhenTheFirstStepWasAlreadyLetGo) {
    Pipeline pipeline{MachineConfig{}};
    pipeline.append(to(0, 0, 0.025, 0, 5));
    pipeline.finish();  // nothing follows, as far as anybody knows
    pipeline.append(to(0, 0, 0, 0, 5));
    pipeline.finish();
    const auto steps = steps_of(pipeline.events, Axis::z);
    ASSERT_EQ(steps.size(), 102u);
    EXPECT_EQ(pipeline.solver.pairs_dropped(), 0u);
    EXPECT_EQ(pipeline.solver.steps_delayed(), 1u);
    EXPECT_EQ(steps[51].time_ns - steps[50].time_ns, 2'000);
    EXPECT_EQ(pipeline.solver.counts()[2], 0);
}

/// Along X at 1 mm/s, from where and when the one before it ends.
motion::Segment slide(const motion::Segment& before, double x_mm) {
    motion::Segment segment;
    segment.start = segment.end = before.end;
    segment.start_mm = before.end_mm;
    segment.end_mm = {x_mm, 0, 0, 0};
    segment.shape = motion::make_trapezoid(std::abs(x_mm - before.end_mm[0]), 1, 1, 1, 1000);
    segment.end.advance_s(segment.shape.duration_s());
    return segment;
}

// The half-step at 0.00625 mm is crossed, crossed back 600 ns later, and crossed again after
// another 600: what is left is the last crossing, at its own time, though the dropped one was less
// than a legal distance before it.
TEST(Solver, TremblingOnAHalfStepLeavesTheLastCrossingWhereItIs) {
    Solver solver{motion::motion_settings(MachineConfig{})};
    std::vector<StepEvent> events;
    motion::Segment segment;
    for (const double x_mm : {0.00625 + 3e-7, 0.00625 - 3e-7, 0.010}) {
        segment = slide(segment, x_mm);
        solver.load(segment);
        solver.solve_some(100, [&](const StepEvent& event) { events.push_back(event); });
    }
    EXPECT_EQ(solver.pairs_dropped(), 1u);
    EXPECT_EQ(solver.steps_delayed(), 0u);
    ASSERT_EQ(events.size(), 1u);
    EXPECT_EQ(events[0].time_ns, 6'250'000 + 1'200);
    EXPECT_EQ(events[0].direction, 1);
}

// What was pulsed before the switch is known only to the player: the step that homes must not be
// paired off.
TEST(Solver, NoPairIsDroppedAcrossAHomingSwitch) {
    Pipeline pipeline{MachineConfig{}};
    ASSERT_TRUE(pipeline.planner->append_homing(Axis::z, motor_bit(Axis::z)));
    pipeline.append(to(0, 0, 0.025, 0, 5));
    ASSERT_TRUE(pipeline.planner->append_homing(Axis::z, 0));
    pipeline.append(to(0, 0, 0, 0, 5));
    pipeline.finish();
    EXPECT_EQ(pipeline.solver.pairs_dropped(), 0u);
    EXPECT_EQ(steps_of(pipeline.events, Axis::z).size(), 102u);
}

TEST(Solver, ACornerDoesNotDisturbTheAxisThatGoesOn) {
    Pipeline pipeline{MachineConfig{}};
    pipeline.append(to(10, 10));
    pipeline.append(to(20, 0));  // Y turns back at speed, X goes on
    pipeline.finish();
    const auto steps = steps_of(pipeline.events, Axis::x);
    ASSERT_EQ(steps.size(), 1600u);
    for (std::size_t i = 1; i < steps.size(); ++i) ASSERT_GT(steps[i].time_ns, steps[i - 1].time_ns + 50'000);
}

TEST(Solver, ResetStartsAfresh) {
    Pipeline pipeline{MachineConfig{}};
    pipeline.append(to(10, 0));
    pipeline.planner->flush();
    motion::Segment segment;
    ASSERT_TRUE(pipeline.planner->next(segment));
    pipeline.solver.load(segment);
    pipeline.solver.solve_some(5, [](const StepEvent&) {});
    EXPECT_FALSE(pipeline.solver.wants_segment());
    pipeline.solver.reset({1, 0, 0, 0});
    pipeline.planner->reset({1, 0, 0, 0}, {5'000, 0});  // long before the end of the 10 mm move
    EXPECT_TRUE(pipeline.solver.wants_segment());
    pipeline.append(to(2, 0));
    pipeline.finish();
    EXPECT_EQ(steps_of(pipeline.events, Axis::x).size(), 80u);
    EXPECT_EQ(pipeline.solver.counts()[0], 160);
    EXPECT_NEAR(static_cast<double>(pipeline.events[0].time_ns), 5'000 + 1e9 * std::sqrt(1.0 / 80 / 2000), 1);
}

TEST(SolverDeathTest, ASegmentThatDoesNotJoinIsABrokenContract) {
    Pipeline pipeline{MachineConfig{}, {5, 0, 0, 0}};
    pipeline.append(to(6, 0));
    pipeline.planner->flush();
    motion::Segment segment;
    ASSERT_TRUE(pipeline.planner->next(segment));
    Solver elsewhere{motion::motion_settings(MachineConfig{}), {50, 0, 0, 0}};
    EXPECT_DEATH(elsewhere.load(segment), "span_steps");
}

// A million moves back and forth on a crooked grid: the count is the end position, rounded, however
// far it has come.
TEST(Solver, NoErrorAddsUp) {
    Pipeline pipeline{MachineConfig{}, {75, 75, 0, 0}};
    pipeline.keep_events = pipeline.keep_segments = false;
    double x = 75, y = 75;
    for (int i = 0; i < 300'000; ++i) {
        x = 75 + std::remainder(i * 0.0317, 0.7);
        y = 75 + std::remainder(i * 0.0119, 0.9);
        pipeline.append(to(x, y, 0, 1.0 / 3000));
    }
    pipeline.finish();
    EXPECT_TRUE(pipeline.solver.gave_all());
    EXPECT_EQ(pipeline.solver.counts()[0], std::lround(x * 80));
    EXPECT_EQ(pipeline.solver.counts()[1], std::lround(y * 80));
    EXPECT_EQ(pipeline.solver.counts()[3], 9600);
}

}  // namespace
}  // namespace qduino::printer::step::solver_test
