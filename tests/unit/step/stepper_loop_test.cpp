#include "printer/step/stepper_loop.h"

#include <gtest/gtest.h>

#include <functional>
#include <memory>

#include "channel/ring_buffer.h"
#include "tests/unit/step/virtual_pins.h"

namespace qduino::printer::step::stepper_loop_test {
namespace {

using test::VirtualPins;
using SmallRing = channel::RingBuffer<StepEvent, 4096>;

constexpr int kX = 0;

struct Stops {
    std::uint32_t asked = 0;
    bool pending = false;
    [[nodiscard]] std::uint32_t stop_asked() const { return asked; }
    [[nodiscard]] bool emergency_pending() const { return pending; }
};

/// Loop 1 works whenever loop 2 looks at the clock.
struct BusyPins : VirtualPins {
    [[nodiscard]] Instant now() const {
        meanwhile();
        return VirtualPins::now();
    }
    std::function<void()> meanwhile = [] {};
};

class StepperLoopTest : public ::testing::Test {
  protected:
    using Loop = StepperLoop<VirtualPins, SmallRing, Stops>;

    void push_steps(int count, std::int64_t first_ns = 0, std::int64_t every_ns = 50'000) {
        for (int i = 0; i < count; ++i)
            ASSERT_TRUE(ring_.try_push({first_ns + every_ns * i, EventKind::step, kX, 1, 0, 0}));
    }
    void run_for(std::int64_t ns) {
        for (const std::int64_t end = pins_.now_ns + ns; pins_.now_ns < end;) loop_.step();
    }
    [[nodiscard]] link::MotionCounts planning() const { return slots_[0].read(); }

    VirtualPins pins_;
    SmallRing ring_;
    Stops stops_;
    std::array<channel::FourSlot<link::MotionCounts>, 2> slots_{};
    Loop::Service service_;
    Loop loop_{pins_, ring_, stops_, Loop::Loops{{&slots_[0], &slots_[1]}}, service_, {}};
};

TEST_F(StepperLoopTest, WithNothingToDoItNapsAMillisecondAtATime) {
    for (int i = 0; i < 5; ++i) loop_.step();
    EXPECT_EQ(pins_.sleeps,
              (std::vector<std::int64_t>{1'000'000, 2'000'000, 3'000'000, 4'000'000, 5'000'000}));
}

TEST_F(StepperLoopTest, NoNapReachesIntoTheHalfMillisecondBeforeAPulse) {
    push_steps(3, 0, 700'000);
    run_for(10'000'000);
    const auto rises = pins_.rises(kX);
    ASSERT_EQ(rises.size(), 3u);
    for (const std::int64_t rise : rises) {
        for (const std::int64_t nap_end : pins_.sleeps)
            EXPECT_FALSE(nap_end > rise - 500'000 && nap_end <= rise) << nap_end << " before " << rise;
    }
    EXPECT_EQ(rises[1] - rises[0], 700'000);
}

TEST_F(StepperLoopTest, TheLoopsAreToldTheSameEveryTenMilliseconds) {
    push_steps(100);
    run_for(30'000'000);
    for (const auto& slot : slots_) {
        const link::MotionCounts status = slot.read();
        EXPECT_EQ(status.steps[kX], 100);
        EXPECT_EQ(status.pulses[kX], 100u);
        EXPECT_EQ(status.events_taken, 100u);
        EXPECT_GE(status.heartbeat, 3u);
        EXPECT_LE(status.heartbeat, 4u);
    }
}

TEST_F(StepperLoopTest, TheServiceIsToldMoreEveryTenthOfASecond) {
    push_steps(100);
    run_for(99'000'000);
    EXPECT_EQ(service_.read().heartbeat, 1u) << "the first word, before any step";
    run_for(2'000'000);
    const link::MotionStatus status = service_.read();
    EXPECT_EQ(status.heartbeat, slots_[0].read().heartbeat);
    EXPECT_EQ(status.steps[kX], 100);
    EXPECT_EQ(status.lateness_ns.count(), 100u);
}

TEST_F(StepperLoopTest, AStopDropsEverythingAndIsAnsweredInTheSameSlice) {
    push_steps(100);
    run_for(4'000'000);
    const std::int64_t before = pins_.position(kX);
    ASSERT_GT(before, 0);
    ASSERT_LT(before, 100);
    stops_.asked = 1;
    loop_.step();
    EXPECT_EQ(planning().stops_served, 1u);
    EXPECT_EQ(planning().steps[kX], before);
    run_for(20'000'000);
    EXPECT_EQ(pins_.position(kX), before) << "what was in the ring is not played";
    EXPECT_EQ(planning().events_taken, 100u);
}

TEST_F(StepperLoopTest, AfterAStopNewStepsArePlayed) {
    stops_.asked = 1;
    loop_.step();
    push_steps(10);
    run_for(10'000'000);
    EXPECT_EQ(pins_.position(kX), 10);
}

TEST_F(StepperLoopTest, WhatIsPushedInTheMiddleOfAnEmergencyStopIsNotPlayed) {
    PlayerSettings at_once;
    at_once.lead = Nanoseconds{0};
    BusyPins pins;
    StepperLoop<BusyPins, SmallRing, Stops> loop{
        pins, ring_, stops_, Loop::Loops{{&slots_[0], &slots_[1]}}, service_, at_once};
    stops_.pending = true;
    pins.meanwhile = [this] { push_steps(1); };
    for (int i = 0; i < 10; ++i) loop.step();
    EXPECT_EQ(pins.position(kX), 0);
}

TEST_F(StepperLoopTest, AnEmergencyCutsTheHeatAtOnceAndUntilLoop1HasTakenIt) {
    push_steps(100);
    run_for(4'000'000);
    stops_.asked = 1;  // loop 1's own stop: nothing is wrong with the heat
    loop_.step();
    EXPECT_TRUE(pins_.heat_cuts.empty());
    stops_.asked = 2;
    stops_.pending = true;
    const std::int64_t asked_ns = pins_.now_ns;
    run_for(10'000'000);
    ASSERT_GE(pins_.heat_cuts.size(), 10u) << "loop 3 may write a duty that it worked out before";
    EXPECT_EQ(pins_.heat_cuts.front(), asked_ns);
    for (std::size_t i = 1; i < pins_.heat_cuts.size(); ++i)
        EXPECT_LE(pins_.heat_cuts[i] - pins_.heat_cuts[i - 1], 1'000'000);
    stops_.pending = false;
    const std::size_t before = pins_.heat_cuts.size();
    run_for(10'000'000);
    EXPECT_EQ(pins_.heat_cuts.size(), before);
}

TEST_F(StepperLoopTest, WhileAnEmergencyIsPendingNothingMovesThoughTheStopWasServed) {
    stops_.asked = 1;
    stops_.pending = true;
    loop_.step();
    EXPECT_EQ(planning().stops_served, 1u);
    push_steps(10);
    run_for(10'000'000);
    EXPECT_EQ(pins_.position(kX), 0);
    stops_.pending = false;  // loop 1 has taken it in, and asks for the stop that belongs to it
    stops_.asked = 2;
    loop_.step();
    push_steps(10);
    run_for(10'000'000);
    EXPECT_EQ(pins_.position(kX), 10);
}

}  // namespace
}  // namespace qduino::printer::step::stepper_loop_test
