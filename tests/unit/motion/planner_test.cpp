#include "printer/motion/planner.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "base/contract.h"

namespace qduino::printer::motion::planner_test {
namespace {

class PlannerTest : public ::testing::Test {
  protected:
    PlannerTest() : planner_(std::make_unique<Planner>(motion_settings(MachineConfig{}))) {}

    static Move to(double x, double y, double z = 0, double e = 0, double speed = 100) {
        return {{x, y, z}, e, speed, 3000};
    }
    std::vector<Segment> take() {
        std::vector<Segment> segments;
        Segment segment;
        while (planner_->next(segment)) segments.push_back(segment);
        return segments;
    }
    std::vector<Segment> take_to_rest() {
        planner_->flush();
        return take();
    }

    std::unique_ptr<Planner> planner_;
};

TEST_F(PlannerTest, OneMoveStartsAndEndsAtRest) {
    ASSERT_TRUE(planner_->append(to(100, 0)));
    const auto segments = take_to_rest();
    ASSERT_EQ(segments.size(), 1u);
    EXPECT_EQ(segments[0].shape.entry_speed_mm_s, 0);
    EXPECT_EQ(segments[0].shape.exit_speed_mm_s, 0);
    EXPECT_EQ(segments[0].shape.cruise_speed_mm_s, 100);
    // What the X axis allows of the 3000 asked for.
    EXPECT_EQ(segments[0].shape.acceleration_mm_s2, 2000);
    EXPECT_EQ(segments[0].start_mm, (AxisVector{0, 0, 0, 0}));
    EXPECT_EQ(segments[0].end_mm, (AxisVector{100, 0, 0, 0}));
    EXPECT_TRUE(planner_->resting());
}

TEST_F(PlannerTest, AQueueWithoutRoomGoesOnAsFastAsItCanBrake) {
    constexpr double kWay_mm = 0.003;
    constexpr std::size_t kRoom = 16, kHeld = Planner::kCapacity - kRoom;
    double x = 0, fastest = 0;
    Segment segment;
    EXPECT_FALSE(planner_->next(segment, kRoom));
    for (int i = 0; i < 3000; ++i) {
        while (planner_->free() >= kRoom) ASSERT_TRUE(planner_->append(to(x += kWay_mm, 0)));
        ASSERT_TRUE(planner_->next(segment, kRoom)) << "move " << i;
        const double left_mm = kWay_mm * static_cast<double>(planner_->size());
        const double exit = segment.shape.exit_speed_mm_s;
        ASSERT_LE(exit * exit, 2 * 2000 * left_mm + 1e-6) << "move " << i << " could not stop";
        fastest = std::max(fastest, exit);
    }
    EXPECT_FALSE(planner_->next(segment, kRoom)) << "there is room for more";
    EXPECT_NEAR(fastest, std::sqrt(2 * 2000 * kWay_mm * kHeld), 0.01);
}

TEST_F(PlannerTest, NothingIsReleasedWhileItsSpeedMayStillRise) {
    ASSERT_TRUE(planner_->append(to(1, 0)));
    EXPECT_TRUE(take().empty());
    ASSERT_TRUE(planner_->append(to(100, 0)));
    // Its end speed is all that acceleration gives in 1 mm: nothing can raise it.
    EXPECT_EQ(take().size(), 1u);
    ASSERT_TRUE(planner_->append(to(100, 50)));
    EXPECT_EQ(take().size(), 1u);  // the corner is what it is
    ASSERT_TRUE(planner_->append(to(100, 51)));
    EXPECT_TRUE(take().empty());  // 1 mm is too short to stop from 100 mm/s, but more may follow
    EXPECT_EQ(take_to_rest().size(), 2u);
}

TEST_F(PlannerTest, DiagonalMovesUseWhatBothAxesAllow) {
    ASSERT_TRUE(planner_->append(to(100, 100, 0, 0, 500)));
    const auto segments = take_to_rest();
    EXPECT_NEAR(segments[0].shape.cruise_speed_mm_s, 125 * std::sqrt(2.0), 1e-9);
    EXPECT_NEAR(segments[0].shape.acceleration_mm_s2, 2000 * std::sqrt(2.0), 1e-9);
}

TEST_F(PlannerTest, SlowAxesSlowTheMove) {
    ASSERT_TRUE(planner_->append(to(10, 0, 1)));
    ASSERT_TRUE(planner_->append(to(10, 0, 11)));
    ASSERT_TRUE(planner_->append(to(10, 0, 11, 5)));
    const auto segments = take_to_rest();
    EXPECT_NEAR(segments[0].shape.cruise_speed_mm_s, 5 * std::sqrt(101.0), 1e-9);
    EXPECT_NEAR(segments[0].shape.acceleration_mm_s2, 30 * std::sqrt(101.0), 1e-9);
    EXPECT_NEAR(segments[1].shape.cruise_speed_mm_s, 5, 1e-9);
    EXPECT_NEAR(segments[2].shape.cruise_speed_mm_s, 14, 1e-9);
    EXPECT_NEAR(segments[2].shape.length_mm, 5, 1e-9);
}

TEST_F(PlannerTest, SpeedMeansThePathInSpaceAndFilamentOnlyWhenNothingElseMoves) {
    ASSERT_TRUE(planner_->append(to(30, 40, 0, 1, 50)));
    ASSERT_TRUE(planner_->append(to(30, 40, 0, -2, 7)));
    const auto segments = take_to_rest();
    EXPECT_NEAR(segments[0].shape.length_mm, 50, 1e-12);
    EXPECT_NEAR(segments[0].shape.cruise_speed_mm_s, 50, 1e-12);
    EXPECT_NEAR(segments[1].shape.length_mm, 2, 1e-12);
    EXPECT_NEAR(segments[1].shape.cruise_speed_mm_s, 7, 1e-12);
    EXPECT_DOUBLE_EQ(segments[1].end_mm[3], -1);
}

TEST_F(PlannerTest, StepRateIsLimitedToLegalPulses) {
    MotionSettings settings = planner_->settings();
    settings.max_speed.fill(1e6_mm_s);
    settings.max_acceleration.fill(1e9_mm_s2);
    planner_->set_settings(settings);
    Move fast = to(100, 0, 0, 0, 1e6);
    fast.acceleration_mm_s2 = 1e9;
    ASSERT_TRUE(planner_->append(fast));
    EXPECT_NEAR(take_to_rest()[0].shape.cruise_speed_mm_s * 80, 1 / 2e-6, 1);
}

TEST_F(PlannerTest, ChangedSettingsApplyToLaterMovesAlone) {
    ASSERT_TRUE(planner_->append(to(50, 0)));
    MotionSettings settings = planner_->settings();
    settings.max_speed[Axis::x] = 30_mm_s;
    planner_->set_settings(settings);
    ASSERT_TRUE(planner_->append(to(100, 0)));
    const auto segments = take_to_rest();
    EXPECT_NEAR(segments[0].shape.cruise_speed_mm_s, 100, 1e-9);
    EXPECT_NEAR(segments[0].shape.exit_speed_mm_s, 30, 1e-9);
    EXPECT_NEAR(segments[1].shape.cruise_speed_mm_s, 30, 1e-9);
}

TEST_F(PlannerTest, SpeedsAndTimesJoinWithoutAGap) {
    for (int i = 1; i <= 2000; ++i) {
        while (!planner_->append(to(75 + 40 * std::cos(i * 0.02), 75 + 40 * std::sin(i * 0.02)))) {
            Segment segment;
            ASSERT_TRUE(planner_->next(segment));
        }
    }
    double speed = -1;
    TimelineInstant at = planner_->released_until();
    for (const Segment& segment : take_to_rest()) {
        if (speed >= 0) {
            EXPECT_EQ(segment.shape.entry_speed_mm_s, speed);
        }
        EXPECT_EQ(segment.start.ns, at.ns);
        EXPECT_EQ(segment.start.fraction_ns, at.fraction_ns);
        speed = segment.shape.exit_speed_mm_s;
        at = segment.end;
    }
    EXPECT_EQ(speed, 0);
}

TEST_F(PlannerTest, NoMoveIsNoSegmentAndLosesNothing) {
    ASSERT_TRUE(planner_->append(to(0, 0)));
    EXPECT_TRUE(take_to_rest().empty());
    for (int i = 1; i <= 1000; ++i) ASSERT_TRUE(planner_->append(to(i * 1e-11, 0)));
    ASSERT_TRUE(planner_->append(to(10, 0)));
    const auto segments = take_to_rest();
    EXPECT_EQ(segments.front().start_mm[0], 0);
    EXPECT_EQ(segments.back().end_mm[0], 10);
}

TEST_F(PlannerTest, ZeroSpeedCreepsButArrives) {
    ASSERT_TRUE(planner_->append(to(1, 0, 0, 0, 0)));
    EXPECT_NEAR(take_to_rest()[0].shape.duration_s(), 100, 1);
}

TEST_F(PlannerTest, MarkersDoNotSlowTheMotion) {
    ASSERT_TRUE(planner_->append(to(50, 0)));
    ASSERT_TRUE(planner_->append_marker(7));
    ASSERT_TRUE(planner_->append_marker(8));
    ASSERT_TRUE(planner_->append(to(100, 0)));
    ASSERT_TRUE(planner_->append_marker(9));
    const auto segments = take_to_rest();
    ASSERT_EQ(segments.size(), 5u);
    EXPECT_NEAR(segments[0].shape.exit_speed_mm_s, 100, 1e-9);
    EXPECT_EQ(segments[1].kind, SegmentKind::marker);
    EXPECT_EQ(segments[1].value, 7u);
    EXPECT_EQ(segments[2].value, 8u);
    EXPECT_EQ(segments[1].start.ns, segments[0].end.ns);
    EXPECT_NEAR(segments[3].shape.entry_speed_mm_s, 100, 1e-9);
    EXPECT_EQ(segments[4].value, 9u);
    EXPECT_EQ(segments[4].start.ns, segments[3].end.ns);
}

TEST_F(PlannerTest, CornersHoldAcrossAMarker) {
    ASSERT_TRUE(planner_->append(to(50, 0)));
    ASSERT_TRUE(planner_->append_marker(1));
    ASSERT_TRUE(planner_->append(to(0, 0)));
    const auto segments = take_to_rest();
    EXPECT_NEAR(segments[0].shape.exit_speed_mm_s, 0, 1e-4);
}

TEST_F(PlannerTest, DwellAndHomingStandStillOnBothSides) {
    ASSERT_TRUE(planner_->append(to(50, 0)));
    ASSERT_TRUE(planner_->append_dwell(0.25));
    ASSERT_TRUE(planner_->append(to(100, 0)));
    ASSERT_TRUE(planner_->append_homing(Axis::y, motor_bit(Axis::y)));
    ASSERT_TRUE(planner_->append(to(150, 0)));
    const auto segments = take_to_rest();
    ASSERT_EQ(segments.size(), 5u);
    EXPECT_EQ(segments[0].shape.exit_speed_mm_s, 0);
    EXPECT_EQ(segments[1].kind, SegmentKind::dwell);
    EXPECT_EQ(segments[1].end.ns - segments[1].start.ns, 250'000'000);
    EXPECT_EQ(segments[2].shape.entry_speed_mm_s, 0);
    EXPECT_EQ(segments[2].shape.exit_speed_mm_s, 0);
    EXPECT_EQ(segments[3].kind, SegmentKind::homing);
    EXPECT_EQ(segments[3].axis, Axis::y);
    EXPECT_EQ(segments[3].value, motor_bit(Axis::y));
    EXPECT_EQ(segments[4].shape.entry_speed_mm_s, 0);
}

TEST_F(PlannerTest, FullQueueRefusesAndThenGivesAtASpeedThatCanBeStopped) {
    for (std::size_t i = 0; i < Planner::kCapacity; ++i)
        ASSERT_TRUE(planner_->append(to(0.001 * double(i + 1), 0)));
    EXPECT_FALSE(planner_->append(to(100, 0)));
    EXPECT_FALSE(planner_->append_marker(1));
    EXPECT_FALSE(planner_->append_dwell(1));
    EXPECT_FALSE(planner_->append_homing(Axis::x, motor_bit(Axis::x)));
    EXPECT_DOUBLE_EQ(planner_->position_mm()[0], 0.001 * Planner::kCapacity);
    const std::size_t taken = take().size();
    EXPECT_GE(taken, 1u);
    EXPECT_LT(taken, Planner::kCapacity);
    EXPECT_EQ(taken + take_to_rest().size(), Planner::kCapacity);
    EXPECT_TRUE(planner_->resting());
}

TEST_F(PlannerTest, AfterAFlushTheNextMoveStartsFromRest) {
    ASSERT_TRUE(planner_->append(to(50, 0)));
    planner_->flush();
    ASSERT_TRUE(planner_->append(to(100, 0)));
    const auto segments = take_to_rest();
    EXPECT_EQ(segments[0].shape.exit_speed_mm_s, 0);
    EXPECT_EQ(segments[1].shape.entry_speed_mm_s, 0);
}

class PlannerHoldTest : public PlannerTest {
  protected:
    /// Ten moves of 5 mm in line; from 100 mm/s the X axis stops in 2.5 mm.
    void start() {
        for (int i = 1; i <= 10; ++i) ASSERT_TRUE(planner_->append(to(5.0 * i, 0)));
        Segment segment;
        ASSERT_TRUE(planner_->next(segment));
        ASSERT_TRUE(planner_->next(segment));
        EXPECT_NEAR(segment.shape.exit_speed_mm_s, 100, 1e-9);
    }
};

TEST_F(PlannerHoldTest, StopsAtTheEarliestEndOfAMoveAndGoesOn) {
    start();
    planner_->hold();
    EXPECT_FALSE(planner_->stopped());
    auto segments = take();
    ASSERT_EQ(segments.size(), 1u);
    EXPECT_EQ(segments[0].shape.exit_speed_mm_s, 0);
    EXPECT_DOUBLE_EQ(segments[0].end_mm[0], 15);
    EXPECT_TRUE(planner_->stopped());
    EXPECT_TRUE(planner_->resting());
    EXPECT_TRUE(take_to_rest().empty());
    ASSERT_TRUE(planner_->append(to(60, 0)));  // may be filled meanwhile
    planner_->resume();
    segments = take_to_rest();
    ASSERT_EQ(segments.size(), 8u);
    EXPECT_EQ(segments[0].shape.entry_speed_mm_s, 0);
    EXPECT_DOUBLE_EQ(segments[0].start_mm[0], 15);
    EXPECT_DOUBLE_EQ(segments.back().end_mm[0], 60);
}

TEST_F(PlannerHoldTest, ResumedBeforeItStoppedStillStopsOnce) {
    start();
    planner_->hold();
    planner_->resume();
    const auto segments = take_to_rest();
    ASSERT_EQ(segments.size(), 8u);
    EXPECT_EQ(segments[0].shape.exit_speed_mm_s, 0);
}

TEST_F(PlannerHoldTest, DiscardingLeavesTheMachineAtTheStop) {
    start();
    planner_->hold();
    take();
    planner_->discard_held();
    EXPECT_FALSE(planner_->held());
    EXPECT_DOUBLE_EQ(planner_->position_mm()[0], 15);
    ASSERT_TRUE(planner_->append(to(0, 0)));
    const auto segments = take_to_rest();
    ASSERT_EQ(segments.size(), 1u);
    EXPECT_DOUBLE_EQ(segments[0].start_mm[0], 15);
}

TEST_F(PlannerHoldTest, FromShortMovesItTakesSeveralToStop) {
    for (int i = 1; i <= 400; ++i) ASSERT_TRUE(planner_->append(to(0.1 * i, 0)));
    Segment segment;
    while (segment.shape.exit_speed_mm_s < 99.999) ASSERT_TRUE(planner_->next(segment));
    const double from_mm = segment.end_mm[0];
    planner_->hold();
    const auto segments = take();
    ASSERT_FALSE(segments.empty());
    EXPECT_EQ(segments.back().shape.exit_speed_mm_s, 0);
    EXPECT_NEAR(segments.back().end_mm[0] - from_mm, 2.5, 0.1001);
}

TEST_F(PlannerHoldTest, AtRestHoldsAtOnceButReportsWhatIsDone) {
    ASSERT_TRUE(planner_->append(to(5, 0)));
    EXPECT_EQ(take_to_rest().size(), 1u);
    ASSERT_TRUE(planner_->append_marker(3));
    ASSERT_TRUE(planner_->append(to(10, 0)));
    planner_->hold();
    const auto segments = take();
    ASSERT_EQ(segments.size(), 1u);
    EXPECT_EQ(segments[0].kind, SegmentKind::marker);
    EXPECT_TRUE(planner_->stopped());
}

TEST_F(PlannerHoldTest, AnEmptyQueueHoldsWhatComes) {
    planner_->hold();
    ASSERT_TRUE(planner_->append(to(5, 0)));
    EXPECT_TRUE(take_to_rest().empty());
    planner_->resume();
    EXPECT_EQ(take_to_rest().size(), 1u);
}

TEST_F(PlannerHoldTest, ResetForgetsEverything) {
    start();
    planner_->hold();
    planner_->reset({1, 2, 3, 4});
    EXPECT_TRUE(planner_->resting());
    EXPECT_FALSE(planner_->held());
    EXPECT_EQ(planner_->position_mm(), (AxisVector{1, 2, 3, 4}));
    ASSERT_TRUE(planner_->append(to(5, 2, 3)));
    const auto segments = take_to_rest();
    ASSERT_EQ(segments.size(), 1u);
    EXPECT_EQ(segments[0].shape.entry_speed_mm_s, 0);
    EXPECT_EQ(segments[0].start_mm[0], 1);
}

TEST(PlannerDeathTest, RefusesMovesThatAreNotNumbers) {
    const auto planner = std::make_unique<Planner>(motion_settings(MachineConfig{}));
    EXPECT_DEATH((void)planner->append({{NAN, 0, 0}, 0, 10, 1000}), "isfinite");
    EXPECT_DEATH((void)planner->append({{1, 0, 0}, 0, 10, 0}), "acceleration");
}

TEST(TimelineInstant, DoesNotDrift) {
    TimelineInstant at;
    for (int i = 0; i < 3'000'000; ++i) at.advance_s(1.0 / 3);
    EXPECT_NEAR(static_cast<double>(at.ns - 1'000'000'000'000'000) + at.fraction_ns, 0, 1);
}

}  // namespace
}  // namespace qduino::printer::motion::planner_test
