// From moves to edges on pins: whatever the moves and however late the player is woken, no rule of
// the driver is broken, no step is lost, and no two steps come nearer than they were meant to, but
// for the threshold.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "channel/ring_buffer.h"
#include "printer/step/player.h"
#include "tests/property/motion/pipeline.h"
#include "tests/property/motion/random_moves.h"
#include "tests/unit/step/virtual_pins.h"

namespace qduino::printer::step::player_property_test {
namespace {

using Ring = channel::RingBuffer<StepEvent, 1024>;
constexpr motion::AxisVector kStart{75, 75, 10, 0};

struct PlayerRun {
    explicit PlayerRun(std::uint64_t seed) : random(seed, kStart), pipeline(MachineConfig{}, kStart) {
        start_counts = pipeline.solver.counts();
        for (const motion::Move& move : random.take(60)) pipeline.append(move);
        pipeline.finish();
    }
    /// Plays everything in calls of 100 µs; `delay_ns` says how late each call begins.
    template <class Delay>
    void play(Delay delay_ns) {
        Player<test::VirtualPins, Ring> player(pins, *ring);
        std::size_t fed = 0;
        const auto& events = pipeline.events;
        while (fed < events.size() || !ring->empty() || player.next_due() != kForever) {
            fed += ring->push_some({events.data() + fed, events.size() - fed});
            pins.now_ns += delay_ns();
            const std::int64_t horizon = pins.now_ns + 100'000;
            player.play_until(instant_from_ns(horizon));
            pins.now_ns = std::max(pins.now_ns, horizon);
        }
        status = player.publish();
    }

    test::RandomMoves random;
    test::Pipeline pipeline;
    std::array<std::int64_t, kAxisCount> start_counts{};
    test::VirtualPins pins;
    std::unique_ptr<Ring> ring = std::make_unique<Ring>();
    link::MotionStatus status;
};

void check_spacing(const PlayerRun& run, std::int64_t slack_ns) {
    std::array<std::size_t, 4> played{};
    std::array<std::vector<std::int64_t>, 4> rises;
    for (int axis = 0; axis < kAxisCount; ++axis) rises[axis] = run.pins.rises(axis);
    std::array<std::int64_t, 4> planned_ns{};
    for (const StepEvent& event : run.pipeline.events) {
        if (event.kind != EventKind::step) continue;
        const std::size_t n = played[event.axis]++;
        ASSERT_LT(n, rises[event.axis].size());
        if (n > 0) {
            const std::int64_t planned = event.time_ns - planned_ns[event.axis];
            ASSERT_GE(rises[event.axis][n] - rises[event.axis][n - 1], planned - slack_ns);
        }
        planned_ns[event.axis] = event.time_ns;
    }
}

TEST(PlayerProperty, OnTimeEveryEdgeIsExact) {
    for (std::uint64_t seed = 1; seed <= 30; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        PlayerRun run(seed);
        run.play([] { return 0; });
        ASSERT_EQ(run.pins.broken_rules(), "");
        ASSERT_EQ(run.status.lateness_ns.max(), 0u);
        ASSERT_EQ(run.status.starved, 0u);
        check_spacing(run, 0);
        for (int axis = 0; axis < kAxisCount; ++axis) {
            ASSERT_EQ(run.pins.position(axis), run.status.steps[axis]);
            ASSERT_EQ(run.pins.position(axis), run.pipeline.solver.counts()[axis] - run.start_counts[axis]);
        }
    }
}

TEST(PlayerProperty, WokenLateAtRandomItStretchesAndNeverBunches) {
    for (std::uint64_t seed = 101; seed <= 130; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        PlayerRun run(seed);
        run.pins.write_cost_ns = 30;
        std::mt19937_64 random(seed);
        run.play([&]() -> std::int64_t { return random() % 20 ? random() % 1'500 : random() % 400'000; });
        ASSERT_EQ(run.pins.broken_rules(), "");
        check_spacing(run, 1'000 + 30 * 8);  // the threshold, and what other axes' writes took
        if (HasFatalFailure()) return;
        for (int axis = 0; axis < kAxisCount; ++axis)
            ASSERT_EQ(run.pins.position(axis), run.status.steps[axis]);
        ASSERT_EQ(run.status.lateness_ns.count(),
                  run.status.pulses[0] + run.status.pulses[1] + run.status.pulses[2] + run.status.pulses[3]);
    }
}

}  // namespace
}  // namespace qduino::printer::step::player_property_test
