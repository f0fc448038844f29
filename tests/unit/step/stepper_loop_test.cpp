#include "printer/step/stepper_loop.h"

#include <gtest/gtest.h>

#include <algorithm>
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

    /// Instants at which step() left, and at which it had told the loops when it began.
    struct Pauses {
        std::vector<std::int64_t> left_ns, told_ns;
    };
    [[nodiscard]] Pauses pauses_of(std::int64_t ns) {
        Pauses pauses;
        for (const std::int64_t end = pins_.now_ns + ns; pins_.now_ns < end;) {
            const std::int64_t began = pins_.now_ns;
            const std::uint64_t told = planning().heartbeat;
            loop_.step();
            pauses.left_ns.push_back(pins_.now_ns);
            if (planning().heartbeat != told) pauses.told_ns.push_back(began);
        }
        return pauses;
    }
    /// How many of `instants` have a rise less than `clear_ns` behind them.
    [[nodiscard]] std::ptrdiff_t hurried(const std::vector<std::int64_t>& instants,
                                         std::int64_t clear_ns) const {
        const auto rises = pins_.rises(kX);
        return std::ranges::count_if(instants, [&](std::int64_t at) {
            return std::ranges::any_of(rises,
                                       [&](std::int64_t rise) { return rise >= at && rise < at + clear_ns; });
        });
    }

    VirtualPins pins_;
    SmallRing ring_;
    std::int64_t next_ns_ = 0;
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

TEST_F(StepperLoopTest, ItReturnsWhereNoPulseIsDueForTwentyMicroseconds) {
    std::int64_t at_ns = 0;
    for (int i = 0; i < 2000; ++i, at_ns += 26'000 + i * 7919 % 13 * 1'000) push_steps(2, at_ns, 5'000);
    const Pauses pauses = pauses_of(60'000'000);
    ASSERT_GT(pauses.left_ns.size(), 600u);
    ASSERT_GE(pauses.told_ns.size(), 5u);
    EXPECT_EQ(hurried(pauses.left_ns, 20'000), 0);
    EXPECT_EQ(hurried(pauses.told_ns, 20'000), 0);
}

TEST_F(StepperLoopTest, ItTellsInARarePause) {
    for (int i = 0; i < 4000; ++i) push_steps(1, i * 15'700 + i / 128 * 200'000);
    const Pauses pauses = pauses_of(60'000'000);
    ASSERT_GE(pauses.told_ns.size(), 5u);
    EXPECT_EQ(hurried(pauses.told_ns, 20'000), 0);
}

TEST_F(StepperLoopTest, PulsesWithoutAPauseDelayStopsByASliceAndTheNewsByTenMilliseconds) {
    push_steps(4000, 0, 15'700);
    const Pauses pauses = pauses_of(55'000'000);
    ASSERT_GE(pauses.told_ns.size(), 3u);
    for (std::size_t i = 1; i < pauses.left_ns.size(); ++i) {
        if (pauses.left_ns[i] < 3'000'000) continue;  // it does not move yet
        EXPECT_LE(pauses.left_ns[i] - pauses.left_ns[i - 1], 103'000);
    }
    for (std::size_t i = 1; i < pauses.told_ns.size(); ++i)
        EXPECT_LE(pauses.told_ns[i] - pauses.told_ns[i - 1], 20'300'000);
}

TEST_F(StepperLoopTest, WithoutAPauseOfTwentyMicrosecondsItReturnsInOneOfFive) {
    for (int i = 0; i < 1200; ++i) push_steps(3, i * 16'000, 3'000);
    const Pauses pauses = pauses_of(19'000'000);
    ASSERT_GT(pauses.left_ns.size(), 100u);
    EXPECT_EQ(hurried(pauses.left_ns, 5'000), 0);
}

TEST_F(StepperLoopTest, WithoutAnyPauseItReturnsAfterAMillisecond) {
    push_steps(4000, 0, 3'000);
    const Pauses pauses = pauses_of(11'000'000);
    for (std::size_t i = 1; i < pauses.left_ns.size(); ++i) {
        const std::int64_t slice_ns = pauses.left_ns[i] - pauses.left_ns[i - 1];
        EXPECT_LE(slice_ns, 1'010'000);
        const bool moves = pauses.left_ns[i - 1] > 3'000'000;
        EXPECT_TRUE(!moves || slice_ns > 900'000) << slice_ns << ": a pulse would be late";
    }
}

TEST_F(StepperLoopTest, WithoutAnyPauseAStopIsServedAsSoonAsEver) {
    BusyPins pins;
    StepperLoop<BusyPins, SmallRing, Stops> loop{
        pins, ring_, stops_, Loop::Loops{{&slots_[0], &slots_[1]}}, service_, {}};
    push_steps(4000, 0, 3'000);
    pins.meanwhile = [&] { stops_.asked = pins.now_ns >= 5'000'000 ? 1 : 0; };
    while (pins.now_ns < 11'000'000) loop.step();
    ASSERT_GT(pins.position(kX), 900);
    EXPECT_LE(pins.rises(kX).back(), 5'110'000);
}

TEST_F(StepperLoopTest, PulsesWithoutAPauseDelayTheServicesStatusLongest) {
    const auto service_told_ns = [&](std::int64_t until_ns) {
        const std::uint64_t before = service_.read().heartbeat;
        while (pins_.now_ns < until_ns && service_.read().heartbeat == before) {
            if (ring_.size() < 64) {
                push_steps(64, next_ns_, 15'700);
                next_ns_ += 64 * 15'700;
            }
            loop_.step();
        }
        return pins_.now_ns;
    };
    service_told_ns(3'000'000);
    const std::int64_t told_ns = service_told_ns(400'000'000);
    EXPECT_GE(told_ns, 199'000'000);
    EXPECT_LE(told_ns, 221'000'000);
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
