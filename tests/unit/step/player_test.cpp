#include "printer/step/player.h"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "channel/ring_buffer.h"
#include "tests/unit/step/virtual_pins.h"

namespace qduino::printer::step::player_test {
namespace {

using test::VirtualPins;
using SmallRing = channel::RingBuffer<StepEvent, 4096>;

constexpr std::int64_t kLead = 2'000'000;
constexpr int kX = 0, kY = 1, kZ = 2;

class PlayerTest : public ::testing::Test {
  protected:
    PlayerTest() : player_(std::make_unique<Player<VirtualPins, SmallRing>>(pins_, ring_)) {}

    void step(std::int64_t time_ns, int axis, int direction = 1) {
        push({time_ns, EventKind::step, static_cast<std::uint8_t>(axis), static_cast<std::int8_t>(direction),
              0, 0});
    }
    void tell(std::int64_t time_ns, EventKind kind, int axis = 0, std::uint32_t value = 0) {
        push({time_ns, kind, static_cast<std::uint8_t>(axis), 1, 0, value});
    }
    void push(const StepEvent& event) { ASSERT_TRUE(ring_.try_push(event)); }
    void play_until_ns(std::int64_t ns) { player_->play_until(instant_from_ns(ns)); }
    void play_all() { play_until_ns(std::int64_t{1} << 50); }

    VirtualPins pins_;
    SmallRing ring_;
    std::unique_ptr<Player<VirtualPins, SmallRing>> player_;
};

TEST_F(PlayerTest, IdleCostsNothingAndMovesNothing) {
    play_until_ns(1'000'000'000);
    EXPECT_EQ(pins_.now_ns, 0);
    EXPECT_TRUE(pins_.edges.empty());
    EXPECT_EQ(player_->next_due(), kForever);
}

TEST_F(PlayerTest, TheFirstStepComesAfterTheLeadAndTheRestKeepTheirDistance) {
    pins_.now_ns = 5'000;
    for (int i = 0; i < 10; ++i) step(70'000 + 100'000 * i, kX);
    play_all();
    const auto rises = pins_.rises(kX);
    ASSERT_EQ(rises.size(), 10u);
    EXPECT_EQ(rises[0], 5'000 + kLead);
    for (std::size_t i = 1; i < rises.size(); ++i) EXPECT_EQ(rises[i] - rises[i - 1], 100'000);
    EXPECT_EQ(player_->steps()[kX], 10);
    EXPECT_EQ(player_->publish().lateness_ns.max(), 0u);
    EXPECT_EQ(player_->publish().shift_ns, 0);
    EXPECT_EQ(pins_.broken_rules(), "");
}

TEST_F(PlayerTest, PulsesAreAsWideAsAskedFor) {
    step(0, kX);
    step(100'000, kX);
    play_all();
    EXPECT_EQ(pins_.falls(kX)[0] - pins_.rises(kX)[0], 1'000);
}

TEST_F(PlayerTest, PulsesOfDifferentAxesOverlapFreely) {
    for (int i = 0; i < 50; ++i) {
        step(100'000 * i, kX);
        step(100'000 * i + 300, kY);
        step(100'000 * i + 600, kZ);
        step(100'000 * i + 1'100, 3);
    }
    play_all();
    for (const int axis : {0, 1, 2, 3}) ASSERT_EQ(pins_.rises(axis).size(), 50u);
    EXPECT_EQ(pins_.rises(kY)[7] - pins_.rises(kX)[7], 300);
    EXPECT_EQ(pins_.rises(kZ)[7] - pins_.rises(kX)[7], 600);
    EXPECT_EQ(pins_.rises(3)[7] - pins_.rises(kX)[7], 1'100);
    EXPECT_EQ(player_->publish().lateness_ns.max(), 0u);
    EXPECT_EQ(pins_.broken_rules(), "");
}

TEST_F(PlayerTest, StepsAtOneInstantRiseInOneWriteAndFallInOne) {
    pins_.write_cost_ns = 150;
    for (int i = 0; i < 50; ++i) {
        step(100'000 * i, kZ);
        step(100'000 * i, kX);
        step(100'000 * i, kY, i % 2 == 0 ? 1 : -1);
        step(100'000 * i + 1, 3);  // another instant
    }
    const std::size_t before = pins_.writes.size();
    play_all();
    ASSERT_EQ(pins_.writes.size() - before, 200u);
    const std::vector three{kZ, kX, kY};  // as they came
    for (std::size_t i = before; i < pins_.writes.size(); i += 4) {
        EXPECT_TRUE(pins_.writes[i].high && pins_.writes[i + 1].high);
        EXPECT_FALSE(pins_.writes[i + 2].high || pins_.writes[i + 3].high);
        for (const std::size_t all : {i, i + 2}) EXPECT_EQ(pins_.writes[all].axes, three);
        for (const std::size_t one : {i + 1, i + 3}) EXPECT_EQ(pins_.writes[one].axes, std::vector{3});
    }
    EXPECT_EQ(pins_.rises(kX), pins_.rises(kZ));
    EXPECT_EQ(pins_.falls(kX), pins_.falls(kY));
    EXPECT_EQ(player_->steps(), (PerAxis<std::int64_t>{50, 0, 50, 50}));
    EXPECT_EQ(player_->publish().lateness_ns.count(), 200u);
    EXPECT_EQ(pins_.broken_rules(), "");
}

TEST_F(PlayerTest, AStepThatIsLateWaitsForNoFallOfAnotherAxis) {
    PlayerSettings patient;
    patient.late_threshold = 1ms;  // the time line stays
    player_ = std::make_unique<Player<VirtualPins, SmallRing>>(pins_, ring_, patient);
    step(0, kX);
    step(1, kY);
    step(4'500, kZ);  // due when X's pulse may end already
    step(30'000, kX);
    pins_.write_cost_ns = 3'000;
    play_all();
    EXPECT_EQ(pins_.rises(kY)[0], kLead + 6'000);
    EXPECT_EQ(pins_.rises(kZ)[0], kLead + 9'000);
    EXPECT_EQ(pins_.falls(kX)[0], kLead + 12'000);
    EXPECT_EQ(pins_.falls(kY)[0], kLead + 12'000) << "both were due, and share a write";
    EXPECT_EQ(pins_.falls(kZ)[0], kLead + 15'000);
    EXPECT_EQ(pins_.rises(kX)[1], kLead + 33'000);
    EXPECT_EQ(pins_.broken_rules(), "");
}

TEST_F(PlayerTest, ALateInstantMovesTheTimeLineOnceForAllItsSteps) {
    for (int i = 0; i < 10; ++i)
        for (const int axis : {kX, kY, kZ}) step(100'000 * i, axis);
    pins_.oversleep_at(kLead + 450'000, 30'000);
    play_all();
    EXPECT_EQ(player_->publish().shift_ns, 30'000);
    EXPECT_EQ(player_->publish().late_steps, 1u);
    for (const int axis : {kX, kY, kZ}) EXPECT_EQ(pins_.rises(axis)[9] - pins_.rises(axis)[5], 400'000);
}

TEST_F(PlayerTest, AnAxisThatMustWaitHoldsNoOtherUp) {
    step(0, kX);
    step(1'000, kY);
    step(1'000, kX);  // its low time is not over: raised at 2000
    step(1'000, kZ);
    play_all();
    EXPECT_EQ(pins_.rises(kY)[0] - pins_.rises(kX)[0], 1'000);
    EXPECT_EQ(pins_.rises(kX)[1] - pins_.rises(kX)[0], 2'000);
    EXPECT_EQ(pins_.broken_rules(), "");
}

TEST_F(PlayerTest, TheHorizonIsKeptAndNothingIsLostAtIt) {
    for (int i = 0; i < 1000; ++i) step(10'000 * i, i % 2);
    for (std::int64_t horizon = 0; horizon < kLead + 10'100'000; horizon += 100'000) {
        play_until_ns(horizon);
        ASSERT_LE(pins_.now_ns, horizon);
        pins_.now_ns = horizon;
    }
    EXPECT_EQ(player_->steps()[kX] + player_->steps()[kY], 1000);
    EXPECT_EQ(player_->publish().lateness_ns.max(), 0u);
    EXPECT_EQ(pins_.broken_rules(), "");
}

TEST_F(PlayerTest, DirectionIsSetBeforeItIsNeededAndNeverCostsTime) {
    for (int i = 0; i < 100; ++i) step(10'000 * i, kX, i / 3 % 2 ? -1 : 1);
    for (int i = 0; i < 100; ++i)
        step(1'000'000 + 2'000 * i, kX, i % 2 ? -1 : 1);  // as near as reversals may be
    play_all();
    EXPECT_EQ(player_->publish().lateness_ns.max(), 0u);
    EXPECT_EQ(pins_.broken_rules(), "");
    EXPECT_EQ(pins_.position(kX), player_->steps()[kX]);
}

TEST_F(PlayerTest, DirectionIsSetAheadThoughOtherAxesStepInBetween) {
    for (int i = 0; i < 50; ++i) {
        const int direction = i % 2 ? -1 : 1;
        step(20'000 * i, kX, direction);
        step(20'000 * i + 5'000, kY);
        step(20'000 * i + 10'000, kY);
        step(20'000 * i + 19'950, kY);  // 50 ns before X steps the other way
    }
    play_all();
    EXPECT_EQ(player_->publish().lateness_ns.max(), 0u);
    EXPECT_EQ(pins_.broken_rules(), "");
    EXPECT_EQ(pins_.position(kX), 0);
}

TEST_F(PlayerTest, AFirstStepBackwardsWaitsForItsSetUp) {
    step(0, kX, -1);
    play_all();
    EXPECT_EQ(pins_.position(kX), -1);
    EXPECT_EQ(pins_.broken_rules(), "");
}

TEST_F(PlayerTest, AStepBackwardsThatWasNotForeseenStillHasItsSetUp) {
    step(0, kX);
    play_until_ns(kLead + 50'000);
    pins_.now_ns = kLead + 99'950;
    step(100'000, kX, -1);
    play_all();
    EXPECT_EQ(pins_.broken_rules(), "");
    EXPECT_EQ(pins_.rises(kX)[1], kLead + 99'950 + 200);
    EXPECT_EQ(player_->publish().lateness_ns.max(), 150u);
}

TEST_F(PlayerTest, LatenessMovesTheTimeLineAndNeverBunchesSteps) {
    for (int i = 0; i < 20; ++i) step(100'000 * i, kX);
    pins_.oversleep_at(kLead + 500'000, 330'000);  // three steps would be due meanwhile
    play_all();
    const auto rises = pins_.rises(kX);
    ASSERT_EQ(rises.size(), 20u);
    EXPECT_EQ(rises[5] - rises[4], 430'000);
    for (std::size_t i = 6; i < rises.size(); ++i) EXPECT_EQ(rises[i] - rises[i - 1], 100'000);
    const link::MotionStatus& status = player_->publish();
    EXPECT_EQ(status.late_steps, 1u);
    EXPECT_EQ(status.shift_ns, 330'000);
    EXPECT_EQ(status.lateness_ns.max(), 330'000u);
    EXPECT_EQ(status.lateness_ns.count(), 20u);
    EXPECT_EQ(status.starved, 0u);
}

TEST_F(PlayerTest, LatenessBelowTheThresholdIsRecordedButNotCarriedOn) {
    for (int i = 0; i < 20; ++i) step(100'000 * i, kX);
    pins_.oversleep_at(kLead + 500'000, 900);
    play_all();
    EXPECT_EQ(pins_.rises(kX)[6], kLead + 600'000);
    EXPECT_EQ(player_->publish().shift_ns, 0);
    EXPECT_EQ(player_->publish().late_steps, 0u);
    EXPECT_EQ(player_->publish().lateness_ns.max(), 900u);
}

TEST_F(PlayerTest, LatenessKeepsTheAxesTogether) {
    for (int i = 0; i < 20; ++i) {
        step(100'000 * i, kX);
        step(100'000 * i + 5'000, kY);
    }
    pins_.oversleep_at(kLead + 500'000, 250'000);
    play_all();
    for (std::size_t i = 0; i < 20; ++i) EXPECT_EQ(pins_.rises(kY)[i] - pins_.rises(kX)[i], 5'000);
    EXPECT_EQ(pins_.broken_rules(), "");
}

TEST_F(PlayerTest, AWidePulseDoesNotMakeTheLowTimeShort) {
    for (int i = 0; i < 20; ++i) step(3'000 * i, kX);
    pins_.oversleep_at(kLead + 10'000, 2'000);  // at a fall: the pulse is 3 µs long
    play_all();
    EXPECT_EQ(pins_.broken_rules(), "");
    EXPECT_EQ(player_->steps()[kX], 20);
    const auto rises = pins_.rises(kX);
    for (std::size_t i = 1; i < rises.size(); ++i) EXPECT_GE(rises[i] - rises[i - 1], 2'000);
}

TEST_F(PlayerTest, PinsThatTakeTimeKeepEveryRule) {
    pins_.write_cost_ns = 130;
    for (int i = 0; i < 300; ++i) {
        step(20'000 * i, kX, i / 2 % 2 ? -1 : 1);
        step(20'000 * i, kY, i / 5 % 2 ? -1 : 1);
        step(20'000 * i + 40, kZ);
    }
    play_all();
    EXPECT_EQ(pins_.broken_rules(), "");
    EXPECT_EQ(player_->publish().late_steps, 0u);
    EXPECT_EQ(pins_.position(kX), player_->steps()[kX]);
    EXPECT_EQ(pins_.position(kY), player_->steps()[kY]);
}

TEST_F(PlayerTest, RunningDryInMotionIsStarvation) {
    step(0, kX);
    step(100'000, kX);
    play_until_ns(kLead + 300'000);
    EXPECT_TRUE(player_->moving());
    pins_.now_ns = kLead + 700'000;
    step(200'000, kX);
    step(300'000, kX);
    play_all();
    const auto rises = pins_.rises(kX);
    EXPECT_EQ(rises[2], kLead + 700'000 + kLead);
    EXPECT_EQ(rises[3] - rises[2], 100'000);
    const link::MotionStatus& status = player_->publish();
    EXPECT_EQ(status.starved, 1u);
    EXPECT_EQ(status.shift_ns, 500'000 + kLead);
}

TEST_F(PlayerTest, RunningDryIsNoHarmWhenTheNextStepComesInTime) {
    step(0, kX);
    play_until_ns(kLead + 50'000);
    step(100'000, kX);
    play_all();
    EXPECT_EQ(pins_.rises(kX)[1] - pins_.rises(kX)[0], 100'000);
    EXPECT_EQ(player_->publish().starved, 0u);
}

TEST_F(PlayerTest, RunningDryAtRestIsIdleness) {
    step(0, kX);
    tell(50'000, EventKind::rest);
    play_until_ns(kLead + 60'000);
    EXPECT_FALSE(player_->moving());
    pins_.now_ns = 60'000'000'000;
    step(150'000, kX);
    play_all();
    EXPECT_EQ(pins_.rises(kX)[1], 60'000'000'000 + kLead);
    EXPECT_EQ(player_->publish().starved, 0u);
    EXPECT_EQ(player_->publish().shift_ns, 0);
}

TEST_F(PlayerTest, MarkersArePassedInTheirTurn) {
    step(0, kX);
    tell(0, EventKind::marker, 0, 11);
    step(100'000, kX);
    tell(200'000, EventKind::marker, 0, 12);
    play_until_ns(kLead + 50'000);
    EXPECT_EQ(player_->publish().last_marker, 11u);
    play_until_ns(kLead + 150'000);
    EXPECT_EQ(player_->publish().last_marker, 11u);
    play_until_ns(kLead + 200'001);
    EXPECT_EQ(player_->publish().last_marker, 12u);
}

TEST_F(PlayerTest, TheTimeLineRunsOnBetweenEventsAndNoFurther) {
    EXPECT_EQ(player_->timeline_ns(), 0);
    step(100'000, kX);
    step(5'000'000, kX);
    tell(6'000'000, EventKind::rest);
    play_until_ns(kLead + 1'000);
    EXPECT_EQ(player_->timeline_ns(), 100'000 + pins_.now_ns - kLead);
    pins_.now_ns = kLead + 1'000'000;
    EXPECT_EQ(player_->timeline_ns(), 1'100'000);
    pins_.now_ns = kLead + 20'000'000;  // late: what has not been played has not been passed
    EXPECT_EQ(player_->timeline_ns(), 5'000'000);
    play_all();
    EXPECT_EQ(player_->timeline_ns(), 6'000'000);
}

TEST_F(PlayerTest, TheTimeLineDoesNotJumpWhenMotionFollowsIdleness) {
    step(0, kX);
    tell(50'000, EventKind::rest);
    play_until_ns(kLead + 60'000);
    pins_.now_ns = 60'000'000'000;
    step(150'000, kX);
    EXPECT_EQ(player_->publish().timeline_ns, 50'000);
    play_all();
    EXPECT_EQ(player_->publish().timeline_ns, 150'000);
}

TEST_F(PlayerTest, StatusTellsWhatThereIs) {
    for (int i = 0; i < 5; ++i) step(100'000 * i, kX);
    EXPECT_EQ(player_->publish().ring_fill, 5u);
    EXPECT_FALSE(player_->publish().moving);
    play_until_ns(kLead + 150'000);
    EXPECT_EQ(player_->publish().ring_fill, 3u);
    EXPECT_TRUE(player_->publish().moving);
    const std::uint64_t heartbeat = player_->publish().heartbeat;
    EXPECT_EQ(player_->publish().heartbeat, heartbeat + 1);
}

// ---- homing -------------------------------------------------------------------------------------

class PlayerHomingTest : public PlayerTest {
  protected:
    /// Homing X towards minus: 1000 steps asked for, the switch is `steps_to_switch` away.
    void home(int steps_to_switch) {
        pins_.endstop = [this, steps_to_switch](int axis) {
            return axis == kX && pins_.position(kX) <= -steps_to_switch;
        };
        tell(0, EventKind::homing, kX, 1 << kX);
        for (int i = 0; i < 1000; ++i) step(100'000 * (i + 1), kX, -1);
        tell(101'000'000, EventKind::rest);
        tell(101'000'000, EventKind::homing, kX, 0);
        tell(101'000'000, EventKind::marker, 0, 5);
    }
};

TEST_F(PlayerHomingTest, StepsEndAtTheSwitchAndTheCounterTells) {
    home(123);
    play_all();
    EXPECT_EQ(pins_.rises(kX).size(), 123u);
    EXPECT_EQ(player_->steps()[kX], -123);
    EXPECT_EQ(player_->steps_dropped(), 877u);
    EXPECT_EQ(player_->publish().last_marker, 5u);
    EXPECT_FALSE(player_->moving());
}

TEST_F(PlayerHomingTest, WhatIsDroppedIsNotWaitedFor) {
    home(123);
    play_all();
    EXPECT_LT(pins_.now_ns, kLead + 124 * 100'000 + 2'000'000);
}

TEST_F(PlayerHomingTest, ASwitchPressedFromTheStartAllowsNoStep) {
    home(0);
    play_all();
    EXPECT_EQ(player_->steps()[kX], 0);
    EXPECT_EQ(player_->steps_dropped(), 1000u);
}

TEST_F(PlayerHomingTest, ASwitchThatIsNeverPressedLeavesEveryStep) {
    home(2000);
    play_all();
    EXPECT_EQ(player_->steps()[kX], -1000);
    EXPECT_EQ(player_->steps_dropped(), 0u);
}

TEST_F(PlayerHomingTest, TheSwitchIsNotLookedAtOutsideHoming) {
    home(123);
    for (int i = 0; i < 10; ++i) step(102'000'000 + 100'000 * i, kX, -1);  // still on the switch
    play_all();
    EXPECT_EQ(player_->steps()[kX], -133);
    EXPECT_EQ(pins_.broken_rules(), "");
}

TEST_F(PlayerHomingTest, StepsAwayFromTheSwitchFollowInTime) {
    home(123);
    for (int i = 0; i < 10; ++i) step(101'000'000 + 100'000 * (i + 1), kX, 1);
    play_all();
    const auto rises = pins_.rises(kX);
    ASSERT_EQ(rises.size(), 133u);
    for (std::size_t i = 124; i < rises.size(); ++i) EXPECT_EQ(rises[i] - rises[i - 1], 100'000);
    EXPECT_EQ(player_->steps()[kX], -113);
    EXPECT_EQ(pins_.position(kX), -113);
    EXPECT_EQ(pins_.broken_rules(), "");
}

TEST_F(PlayerHomingTest, TwoAxesHomeTogetherEachToItsOwnSwitch) {
    pins_.endstop = [this](int axis) { return pins_.position(axis) <= (axis == kX ? -50 : -200); };
    tell(0, EventKind::homing, kX, 1 << kX);
    tell(0, EventKind::homing, kY, 1 << kY);
    for (int i = 0; i < 1000; ++i) {
        step(100'000 * (i + 1), kX, -1);
        step(100'000 * (i + 1), kY, -1);
    }
    tell(101'000'000, EventKind::rest);
    tell(101'000'000, EventKind::homing, kX, 0);
    tell(101'000'000, EventKind::homing, kY, 0);
    play_all();
    EXPECT_EQ(player_->steps()[kX], -50);
    EXPECT_EQ(player_->steps()[kY], -200);
    const auto rises = pins_.rises(kY);
    for (std::size_t i = 1; i < rises.size(); ++i) EXPECT_EQ(rises[i] - rises[i - 1], 100'000);
    EXPECT_LT(pins_.now_ns, kLead + 201 * 100'000 + 2'000'000);
}

// CoreXY: the switch of X, which A and B reach together.
TEST_F(PlayerHomingTest, ASwitchEndsEveryMotorOfItsMaskAndLeavesThemInPairs) {
    pins_.endstop = [this](int axis) {
        return axis == kX && pins_.position(kX) + pins_.position(kY) <= -201;
    };
    tell(0, EventKind::homing, kX, 0b0011);
    for (int i = 0; i < 400; ++i) {
        step(100'000 * (i + 1), kX, -1);
        step(100'000 * (i + 1), kY, -1);
    }
    tell(101'000'000, EventKind::homing, kX, 0);
    step(101'100'000, kY, 1);
    play_all();
    EXPECT_EQ(player_->steps()[kX], -101);
    EXPECT_EQ(player_->steps()[kY], -101 + 1);
    EXPECT_EQ(player_->endstop_hits()[Axis::x], 1u);
    EXPECT_EQ(player_->endstop_hits()[Axis::y], 0u);
}

TEST_F(PlayerHomingTest, ThePinsAreToldWhichSwitchesAreWatched) {
    pins_.endstop = [](int) { return false; };
    tell(0, EventKind::homing, kX, 0b0011);
    tell(1'000, EventKind::marker, 0, 1);
    play_until_ns(kLead + 500);
    EXPECT_EQ(pins_.watched, 1u << kX);
    tell(10'000, EventKind::homing, kX, 0);
    play_all();
    EXPECT_EQ(pins_.watched, 0u);
}

TEST_F(PlayerHomingTest, SkippingIsBoundedInEachCall) {
    pins_.endstop = [](int) { return true; };
    tell(0, EventKind::homing, kX, 1 << kX);
    for (int i = 0; i < 4000; ++i) step(1'000 + 100'000 * i, kX, -1);
    play_until_ns(kLead + 10'000);
    EXPECT_GT(ring_.size(), 2000u);
    for (int i = 0; i < 5; ++i) play_until_ns(kLead + 20'000 * (i + 2));
    EXPECT_TRUE(ring_.empty());
}

// ---- emergency ----------------------------------------------------------------------------------

TEST_F(PlayerTest, StopNowEndsThePulseAndDropsEverything) {
    for (int i = 0; i < 1000; ++i) step(100'000 * i, kX);
    play_until_ns(kLead + 500'500);  // in the middle of a pulse
    EXPECT_TRUE(pins_.level(kX));
    player_->stop_now();
    EXPECT_FALSE(pins_.level(kX));
    const auto pulses = pins_.rises(kX).size();
    EXPECT_EQ(pulses, 6u);
    play_all();
    EXPECT_EQ(pins_.rises(kX).size(), pulses);
    EXPECT_EQ(player_->steps()[kX], 6);
    EXPECT_FALSE(player_->moving());
    EXPECT_EQ(player_->next_due(), kForever);
}

TEST_F(PlayerTest, AfterAStopItPlaysOnlyWhatComesAfterMotionIsAllowed) {
    for (int i = 0; i < 10; ++i) step(100'000 * i, kX, -1);
    play_until_ns(kLead + 500'500);
    player_->stop_now();
    EXPECT_TRUE(player_->stopped());
    for (int i = 0; i < 10; ++i) step(600'000 + 100'000 * i, kX, -1);  // pushed before anybody knew
    play_until_ns(kLead + 3'000'000);
    for (int i = 0; i < 10; ++i) step(600'000 + 100'000 * i, kX, -1);
    player_->allow_motion();
    for (int i = 0; i < 10; ++i) step(700'000 + 100'000 * i, kX, i < 5 ? 1 : -1);
    play_all();
    EXPECT_EQ(player_->steps()[kX], -6);
    EXPECT_EQ(pins_.position(kX), -6);
    EXPECT_EQ(player_->publish().starved, 0u);
    const auto rises = pins_.rises(kX);
    EXPECT_EQ(rises[7] - rises[6], 100'000);
}

TEST_F(PlayerTest, NothingPushedBeforeAStopComesBack) {
    for (int i = 0; i < 10; ++i) step(100'000 * i, kX);
    play_until_ns(kLead + 500'500);
    for (int i = 10; i < 50; ++i) step(100'000 * i, kX);
    player_->stop_now();
    player_->allow_motion();
    play_all();
    EXPECT_EQ(pins_.rises(kX).size(), 6u);
    step(0, kY);
    play_all();
    EXPECT_EQ(pins_.rises(kX).size(), 6u);
    EXPECT_EQ(pins_.rises(kY).size(), 1u);
}

}  // namespace
}  // namespace qduino::printer::step::player_test
