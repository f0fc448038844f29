#include "printer/motion/junction.h"

#include <gtest/gtest.h>

#include <cmath>

namespace qduino::printer::motion::junction_test {
namespace {

using Speeds = PerAxis<MillimetresPerSecond>;

constexpr Speeds kUnlimited{1e9_mm_s, 1e9_mm_s, 1e9_mm_s, 1e9_mm_s};

MoveGeometry heading(double degrees, double length_mm = 100) {
    const double angle = degrees * M_PI / 180;
    MoveGeometry move;
    move.direction = {std::cos(angle), std::sin(angle), 0, 0};
    move.length_mm = length_mm;
    move.acceleration_mm_s2 = 3000;
    move.deviation_mm = junction_deviation_mm(20, 3000);
    move.speed_mm_s = 100;
    return move;
}

double speed(const MoveGeometry& before, const MoveGeometry& after,
             const Speeds& instantaneous = kUnlimited) {
    return std::sqrt(junction_speed_squared(before, after, instantaneous));
}

TEST(Junction, SquareCornerAtTheSquareCornerSpeed) {
    EXPECT_NEAR(speed(heading(0), heading(90)), 20, 1e-9);
    EXPECT_NEAR(speed(heading(30), heading(-60)), 20, 1e-9);
}

TEST(Junction, StraightOnAtTheLowerNominalSpeed) {
    MoveGeometry slow = heading(0);
    slow.speed_mm_s = 40;
    EXPECT_DOUBLE_EQ(speed(heading(0), heading(0)), 100);
    EXPECT_DOUBLE_EQ(speed(heading(0), slow), 40);
    EXPECT_DOUBLE_EQ(speed(slow, heading(0)), 40);
    EXPECT_NEAR(speed(heading(0), heading(1e-7)), 100, 1e-9);
}

TEST(Junction, TurningBackIsAStandstill) { EXPECT_NEAR(speed(heading(0), heading(180)), 0, 1e-5); }

TEST(Junction, FollowsTheTextbookFormulaAtEveryAngle) {
    for (int turn = 5; turn < 175; turn += 5) {
        const double theta = (180 - turn) * M_PI / 180;
        const double s = std::sqrt((1 - std::cos(theta)) / 2);
        const double deviation = 400 * (std::sqrt(2.0) - 1) / 3000;
        EXPECT_NEAR(speed(heading(10), heading(10 + turn)),
                    std::min(100.0, std::sqrt(3000 * deviation * s / (1 - s))), 1e-9)
            << turn;
    }
}

TEST(Junction, ShortMovesAreHeldToTheArcThatFitsInThem) {
    const double half = 0.5 * (180 - 10) * M_PI / 180;
    EXPECT_NEAR(speed(heading(0, 0.01), heading(10, 0.01)), std::sqrt(0.5 * 0.01 * 3000 * std::tan(half)),
                1e-9);
    EXPECT_NEAR(speed(heading(0, 100), heading(10, 0.01)), std::sqrt(0.5 * 0.01 * 3000 * std::tan(half)),
                1e-9);
}

TEST(Junction, TheSlowerAccelerationCounts) {
    MoveGeometry weak = heading(90);
    weak.acceleration_mm_s2 = 750;
    EXPECT_NEAR(speed(heading(0), weak), 10, 1e-9);
    EXPECT_NEAR(speed(weak, heading(0)), 10, 1e-9);
}

TEST(Junction, ExtruderAndZHaveTheirOwnLimit) {
    MoveGeometry printing = heading(0);
    printing.direction[3] = 0.05;
    EXPECT_NEAR(speed(heading(0), printing, {1e9_mm_s, 1e9_mm_s, 0.4_mm_s, 2.5_mm_s}), 50, 1e-9);
    MoveGeometry rising = heading(0);
    rising.direction[2] = 0.01;
    EXPECT_NEAR(speed(heading(0), rising, {0_mm_s, 0_mm_s, 0.4_mm_s, 2.5_mm_s}), 40, 1e-9);
    EXPECT_NEAR(speed(printing, printing, Speeds{}), 100, 1e-9);
}

TEST(Junction, ExtrudeOnlyMeetsMotionAtRestAndItselfInMotion) {
    MoveGeometry retract;
    retract.direction = {0, 0, 0, -1};
    retract.extrude_only = true;
    retract.length_mm = 1;
    retract.acceleration_mm_s2 = 1000;
    retract.deviation_mm = 0.01;
    retract.speed_mm_s = 30;
    EXPECT_EQ(speed(heading(0), retract), 0);
    EXPECT_EQ(speed(retract, heading(0)), 0);
    EXPECT_DOUBLE_EQ(speed(retract, retract), 30);
    MoveGeometry prime = retract;
    prime.direction[3] = 1;
    EXPECT_EQ(speed(retract, prime), 0);
}

}  // namespace
}  // namespace qduino::printer::motion::junction_test
