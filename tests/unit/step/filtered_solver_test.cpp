// The solver where the motion is filtered: standstills, markers, changes on the way.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/property/motion/pipeline.h"
#include "tests/property/motion/random_moves.h"

namespace qduino::printer::step::filtered_solver_test {
namespace {

using motion::Move;
using test::Pipeline;

MachineConfig shaped() {
    MachineConfig config;
    config.axes[Axis::x].shaper = {ShaperType::mzv, 40, 0.1};
    config.axes[Axis::y].shaper = {ShaperType::ei, 50, 0.1};
    config.pressure_advance.advance = Seconds{0.05};
    return config;
}

Move to(double x, double y, double e = 0, double speed = 100) { return {{x, y, 0}, e, speed, 3000}; }

/// Counts of all motors when the event of `kind` and number `value` is reached.
std::array<std::int64_t, kAxisCount> counts_at(const std::vector<StepEvent>& events, EventKind kind,
                                               std::uint32_t value) {
    std::array<std::int64_t, kAxisCount> counts{};
    for (const StepEvent& event : events) {
        if (event.kind == kind && event.value == value) return counts;
        if (event.kind == EventKind::step) counts[event.axis] += event.direction;
    }
    ADD_FAILURE() << "no such event";
    return counts;
}

void expect_in_order(const std::vector<StepEvent>& events) {
    for (std::size_t i = 1; i < events.size(); ++i) ASSERT_GE(events[i].time_ns, events[i - 1].time_ns);
}

TEST(FilteredSolver, ADwellFindsTheMotorsAtTheirPlace) {
    Pipeline pipeline{shaped()};
    pipeline.append(to(10, 5, 0.4));
    ASSERT_TRUE(pipeline.planner->append_dwell(0));
    pipeline.append(to(0, 0, 0.4));
    pipeline.finish();
    expect_in_order(pipeline.events);
    EXPECT_EQ(counts_at(pipeline.events, EventKind::rest, 0),
              (std::array<std::int64_t, kAxisCount>{800, 400, 0, 38}));
    EXPECT_EQ(pipeline.solver.counts(), (std::array<std::int64_t, kAxisCount>{0, 0, 0, 77}));
    EXPECT_TRUE(pipeline.solver.gave_all());
}

// The shares of an impulse sum to 1 but for a rounding error. A rest on the very half-step is
// rounded as the plan rounds it, on every visit.
TEST(FilteredSolver, ARestOnAHalfStepIsThePlansOwn) {
    Pipeline pipeline{shaped()};
    for (int visit = 1; visit <= 60; ++visit) {
        const double x = (visit * 37 % 200 + 0.5) / 80, y = (visit * 71 % 300 + 0.5) / 80;
        pipeline.append(to(x, y));
        pipeline.finish();
        ASSERT_EQ(pipeline.solver.counts()[0], whole_steps(x * 80)) << visit;
        ASSERT_EQ(pipeline.solver.counts()[1], whole_steps(y * 80)) << visit;
    }
}

// Endstops are watched from the very place where the motion before has ended.
TEST(FilteredSolver, HomingBeginsAndEndsAtRest) {
    Pipeline pipeline{shaped(), {10, 10, 0, 0}};
    pipeline.append(to(20, 20));
    ASSERT_TRUE(pipeline.planner->append_homing(Axis::x, true));
    pipeline.append(to(-20, 20));
    ASSERT_TRUE(pipeline.planner->append_homing(Axis::x, false));
    pipeline.append(to(-10, 10));
    pipeline.finish();
    EXPECT_EQ(counts_at(pipeline.events, EventKind::homing, 1),
              (std::array<std::int64_t, kAxisCount>{800, 800, 0, 0}));
    EXPECT_EQ(counts_at(pipeline.events, EventKind::homing, 0),
              (std::array<std::int64_t, kAxisCount>{-2400, 800, 0, 0}));
}

TEST(FilteredSolver, AMarkerComesWhenEverythingBeforeItHasBeenPlayed) {
    Pipeline pipeline{shaped()};
    for (std::uint32_t i = 1; i <= 3000; ++i) {
        ASSERT_TRUE(pipeline.planner->append_marker(i));
        if (i % 100 != 0) continue;
        // X and Y in turns: what comes behind a marker is another motor's.
        const double turn = i / 100;
        pipeline.append(to(10 * std::ceil(turn / 2), 10 * std::floor(turn / 2)));
        pipeline.pump();
    }
    pipeline.finish();
    expect_in_order(pipeline.events);
    std::uint32_t expected = 0;
    for (const StepEvent& event : pipeline.events) {
        if (event.kind != EventKind::marker) continue;
        ++expected;
        ASSERT_EQ(event.value, expected);
    }
    EXPECT_EQ(expected, 3000u);
    for (std::uint32_t turn = 1; turn < 30; ++turn) {
        const auto counts = counts_at(pipeline.events, EventKind::marker, 100 * turn + 1);
        EXPECT_EQ(turn % 2 == 1 ? counts[0] : counts[1], 800 * ((turn + 1) / 2)) << turn;
    }
}

// Other filters in the middle of a path: the motors stand there, and everything goes on.
TEST(FilteredSolver, FiltersChangeAtTheirPlace) {
    Pipeline pipeline{MachineConfig{}};
    pipeline.append(to(10, 0));
    const motion::MotionFilters filters = motion::motion_settings(shaped()).filters;
    ASSERT_TRUE(pipeline.planner->append_filters(filters));
    ASSERT_TRUE(pipeline.planner->append_marker(1));
    pipeline.append(to(20, 0));
    ASSERT_TRUE(pipeline.planner->append_filters({}));
    ASSERT_TRUE(pipeline.planner->append_marker(2));
    pipeline.append(to(30, 10));
    pipeline.finish();
    expect_in_order(pipeline.events);
    EXPECT_EQ(counts_at(pipeline.events, EventKind::marker, 1)[0], 800);
    EXPECT_EQ(counts_at(pipeline.events, EventKind::marker, 2)[0], 1600);
    EXPECT_EQ(pipeline.solver.counts(), (std::array<std::int64_t, kAxisCount>{2400, 800, 0, 0}));
    EXPECT_FALSE(pipeline.solver.filters().active());
}

// Filters run on behind the plan. What follows without filters is later as a whole: no step of it
// is squeezed into what is left of its time.
TEST(FilteredSolver, AMotionBehindFiltersThatAreSwitchedOffIsNotSqueezed) {
    const auto last_steps = [](bool filtered) {
        Pipeline pipeline{filtered ? shaped() : MachineConfig{}};
        pipeline.append(to(20, 50));
        EXPECT_TRUE(pipeline.planner->append_filters({}));
        pipeline.append(to(50, 50));
        pipeline.append(to(50, 20));
        pipeline.finish();
        expect_in_order(pipeline.events);
        std::vector<std::int64_t> times_ns;
        for (const StepEvent& event : pipeline.events)
            if (event.kind == EventKind::step) times_ns.push_back(event.time_ns);
        times_ns.erase(times_ns.begin(), times_ns.end() - 4800);
        return times_ns;
    };
    const std::vector<std::int64_t> behind = last_steps(true), plain = last_steps(false);
    const std::int64_t later_ns = behind.front() - plain.front();
    EXPECT_GT(later_ns, 1'000'000);
    for (std::size_t i = 0; i < plain.size(); ++i)
        ASSERT_NEAR(static_cast<double>(behind[i] - plain[i]), static_cast<double>(later_ns), 1) << i;
}

// The first of the two moves is longer in time when it is shaped; the advance pushes, and draws
// back.
TEST(FilteredSolver, AdvancePushesAheadAndComesBack) {
    Pipeline plain{MachineConfig{}}, ahead{shaped()};
    for (Pipeline* pipeline : {&plain, &ahead}) {
        pipeline->append(to(50, 0, 5, 50));
        pipeline->finish();
        EXPECT_EQ(pipeline->solver.counts()[3], 480);
    }
    const auto highest = [](const Pipeline& pipeline) {
        std::int64_t at = 0, most = 0;
        for (const StepEvent& event : pipeline.events)
            if (event.kind == EventKind::step && event.axis == 3)
                most = std::max(most, at += event.direction);
        return most;
    };
    EXPECT_EQ(highest(plain), 480);
    // 5 mm/s of filament times 0.05 s are 24 microsteps, most of them still there when it brakes.
    EXPECT_GT(highest(ahead), 485);
}

TEST(FilteredSolver, APieceMealSolutionIsTheSame) {
    std::vector<StepEvent> expected;
    for (const std::size_t portion : {~std::size_t{0}, std::size_t{1}, std::size_t{7}}) {
        Pipeline pipeline{shaped(), {75, 75, 10, 0}};
        test::RandomMoves random(5, {75, 75, 10, 0});
        pipeline.portion = portion;
        for (const Move& move : random.take(60)) ASSERT_TRUE(pipeline.planner->append(move));
        pipeline.finish();
        if (expected.empty()) expected = pipeline.events;
        ASSERT_EQ(pipeline.events.size(), expected.size());
        ASSERT_EQ(test::first_difference(pipeline.events, expected), expected.size());
    }
}

// A curve of a thousand moves within the reach of the filters, far more than the queue of pieces
// holds: they are joined, and every motor ends where it should.
TEST(FilteredSolver, MovesOfMicrosecondsAreJoined) {
    MachineConfig config = shaped();
    config.axes[Axis::x].shaper.frequency_hz = 10;
    Pipeline pipeline{config};
    pipeline.keep_segments = false;
    for (int i = 1; i <= 60'000; ++i) pipeline.append(to(i * 0.001, 0, 0.0001, 100));
    pipeline.finish();
    EXPECT_EQ(pipeline.solver.counts(), (std::array<std::int64_t, kAxisCount>{4800, 0, 0, 576}));
    expect_in_order(pipeline.events);
}

TEST(FilteredSolver, ResetForgetsTheMotionAndKeepsTheFilters) {
    Pipeline pipeline{shaped()};
    pipeline.append(to(10, 0));
    pipeline.planner->flush();
    motion::Segment segment;
    ASSERT_TRUE(pipeline.planner->next(segment));
    pipeline.solver.load(segment);
    pipeline.solver.solve_some(5, [](const StepEvent&) {});
    pipeline.solver.reset({1, 0, 0, 0});
    pipeline.planner->reset({1, 0, 0, 0});
    EXPECT_TRUE(pipeline.solver.gave_all());
    pipeline.append(to(2, 0));
    pipeline.finish();
    EXPECT_EQ(pipeline.solver.counts()[0], 160);
    EXPECT_TRUE(pipeline.solver.filters().active());
}

// ---- steps there and back -----------------------------------------------------------------------

/// The shortest time between two steps of one motor that go against each other.
std::int64_t nearest_reversal_ns(const std::vector<StepEvent>& events) {
    std::int64_t nearest = 1'000'000'000;
    std::array<StepEvent, kAxisCount> last{};
    for (const StepEvent& event : events) {
        if (event.kind != EventKind::step) continue;
        StepEvent& before = last[event.axis];
        if (before.time_ns > 0 && before.direction != event.direction)
            nearest = std::min(nearest, event.time_ns - before.time_ns);
        before = event;
    }
    return nearest;
}

TEST(ReversalGap, NoPairIsNearerWhateverTheMotion) {
    for (const bool filtered : {false, true}) {
        std::int64_t all_ns = 1'000'000'000;
        for (std::uint64_t seed = 1; seed <= 8; ++seed) {
            for (const Nanoseconds gap : {Nanoseconds{2us}, Nanoseconds{750us}}) {
                SCOPED_TRACE(seed);
                MachineConfig config = filtered ? shaped() : MachineConfig{};
                config.reversal_gap = gap;
                Pipeline pipeline{config, {75, 75, 10, 0}};
                test::RandomMoves random(seed, {75, 75, 10, 0});
                for (const Move& move : random.take(400)) pipeline.append(move);
                pipeline.finish();
                const std::int64_t nearest = nearest_reversal_ns(pipeline.events);
                EXPECT_GE(nearest, to_ns(gap));
                if (gap == 2us) all_ns = std::min(all_ns, nearest);
            }
        }
        EXPECT_LT(all_ns, 750'000);  // or the setting would have had nothing to do
    }
}

}  // namespace
}  // namespace qduino::printer::step::filtered_solver_test
