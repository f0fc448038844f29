// Kinematics: back and forth, and every bound that is worked out in one step against a thousand
// samples of the way.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "printer/kinematics.h"

namespace qduino::printer::kinematics_property_test {
namespace {

constexpr double kArm = 215, kRadius = 105, kBed = 90;

MachineConfig machine_of(KinematicsType type) {
    MachineConfig machine;
    machine.kinematics.type = type;
    if (type != KinematicsType::delta) return machine;
    machine.kinematics.arm_length = Millimetres{kArm};
    machine.kinematics.delta_radius = Millimetres{kRadius};
    machine.kinematics.bed_radius = Millimetres{kBed};
    machine.kinematics.home_height = Millimetres{250};
    machine.kinematics.endstop_offset = {Millimetres{0.3}, Millimetres{-0.2}, Millimetres{0}};
    return machine;
}

class KinematicsProperty : public testing::TestWithParam<KinematicsType> {
  protected:
    /// A place above the bed.
    AxisValues place(double z_max = 200) {
        const double angle = uniform(0, 2 * std::numbers::pi), reach = kBed * std::sqrt(uniform(0, 1));
        return {reach * std::cos(angle), reach * std::sin(angle), uniform(0, z_max), uniform(-500, 500)};
    }
    double uniform(double low, double high) {
        return std::uniform_real_distribution<double>{low, high}(random_);
    }
    static AxisValues between(const AxisValues& from, const AxisValues& to, double share) {
        AxisValues at{};
        for (std::size_t i = 0; i < kAxisCount; ++i) at[i] = from[i] + share * (to[i] - from[i]);
        return at;
    }
    static double length_of(const AxisValues& from, const AxisValues& to) {
        return std::hypot(to[0] - from[0], to[1] - from[1], to[2] - from[2]);
    }

    const MachineConfig machine_ = machine_of(GetParam());
    const Kinematics kinematics_{machine_};
    std::mt19937 random_{20261123};
};

TEST_P(KinematicsProperty, TheMotorsLeadBackToTheTool) {
    for (int i = 0; i < 20000; ++i) {
        const AxisValues tool = place();
        const AxisValues back = kinematics_.tool_from_motors(kinematics_.motors_from_tool(tool));
        for (std::size_t axis = 0; axis < kAxisCount; ++axis)
            ASSERT_NEAR(back[axis], tool[axis], 1e-9) << "place " << i;
    }
}

TEST_P(KinematicsProperty, AMotorMovesWithTheAxesThatAreItsOwn) {
    const AxisValues here{10, -20, 30, 0};
    for (const Axis axis : {Axis::x, Axis::y, Axis::z, Axis::e}) {
        AxisValues there = here;
        there[axis] += 7;
        const AxisValues before = kinematics_.motors_from_tool(here),
                         after = kinematics_.motors_from_tool(there);
        for (const Axis motor : {Axis::x, Axis::y, Axis::z, Axis::e})
            EXPECT_EQ(before[motor] != after[motor], (kinematics_.motors_of(axis) & motor_bit(motor)) != 0)
                << kAxisLetter[axis] << " and motor " << kAxisLetter[motor];
    }
}

TEST_P(KinematicsProperty, NoMotorIsFasterThanItsRateAndOneIsNearlyAsFast) {
    for (int i = 0; i < 500; ++i) {
        const AxisValues from = place(), to = place();
        const double length = length_of(from, to);
        const AxisValues rates = kinematics_.rates(from, to, length);
        AxisValues seen{};
        AxisValues last = kinematics_.motors_from_tool(from);
        constexpr int kSamples = 1000;
        for (int k = 1; k <= kSamples; ++k) {
            const AxisValues at = kinematics_.motors_from_tool(between(from, to, double(k) / kSamples));
            for (std::size_t motor = 0; motor < kAxisCount; ++motor)
                seen[motor] = std::max(seen[motor], std::abs(at[motor] - last[motor]) / (length / kSamples));
            last = at;
        }
        for (std::size_t motor = 0; motor < kAxisCount; ++motor) {
            ASSERT_LE(seen[motor], rates[motor] + 1e-7) << "way " << i;
            ASSERT_GE(seen[motor], rates[motor] - 0.01) << "way " << i;
        }
    }
}

INSTANTIATE_TEST_SUITE_P(All, KinematicsProperty,
                         testing::Values(KinematicsType::cartesian, KinematicsType::corexy,
                                         KinematicsType::delta));

class DeltaProperty : public KinematicsProperty {};

TEST_P(DeltaProperty, EachJointIsAnArmAwayAndAboveTheNozzle) {
    for (int i = 0; i < 2000; ++i) {
        const AxisValues tool = place();
        const AxisValues motors = kinematics_.motors_from_tool(tool);
        for (std::size_t tower = 0; tower < kTowerCount; ++tower) {
            const double angle = machine_.kinematics.tower_angle_degrees[tower] * std::numbers::pi / 180;
            const double x = kRadius * std::cos(angle), y = kRadius * std::sin(angle);
            ASSERT_NEAR(std::hypot(tool[0] - x, tool[1] - y, tool[2] - motors[tower]), kArm, 1e-9);
            ASSERT_GT(motors[tower], tool[2]);
        }
    }
}

TEST_P(DeltaProperty, ThereIsRoomWhereNoSampleIsAboveItsSwitch) {
    const AxisValues home = kinematics_.at_switches();
    const AxisValues switches = kinematics_.motors_from_tool(home);
    int with_room = 0;
    for (int i = 0; i < 2000; ++i) {
        const AxisValues from = place(260), to = place(260);
        double over = -1e9;
        for (int k = 0; k <= 1000; ++k) {
            const AxisValues at = kinematics_.motors_from_tool(between(from, to, k / 1000.0));
            for (std::size_t tower = 0; tower < kTowerCount; ++tower)
                over = std::max(over, at[tower] - switches[tower]);
        }
        if (std::abs(over) < 1e-3) continue;  // the samples cannot tell
        ASSERT_EQ(kinematics_.carriages_have_room(from, to, 0), over < 0) << "way " << i << ": " << over;
        with_room += over < 0 ? 1 : 0;
    }
    EXPECT_GT(with_room, 200);
    EXPECT_LT(with_room, 1800);
}

TEST_P(DeltaProperty, TheCeilingIsWhereTheFirstCarriageIsAtItsSwitch) {
    for (int i = 0; i < 200; ++i) {
        AxisValues at = place();
        at[2] = kinematics_.ceiling(at[0], at[1]);
        EXPECT_TRUE(kinematics_.carriages_have_room(at, at, 1e-9));
        at[2] += 0.001;
        EXPECT_FALSE(kinematics_.carriages_have_room(at, at, 1e-9));
    }
}

INSTANTIATE_TEST_SUITE_P(Delta, DeltaProperty, testing::Values(KinematicsType::delta));

TEST(Kinematics, ADeltasHomeIsWhereItsSwitchesPutTheNozzle) {
    MachineConfig machine = machine_of(KinematicsType::delta);
    machine.kinematics.endstop_offset = {};
    place_delta_home(machine);
    for (const Axis axis : {Axis::x, Axis::y, Axis::z})
        EXPECT_NEAR(machine.axes[axis].home_position.value(), axis == Axis::z ? 250 : 0, 1e-9);
    machine = machine_of(KinematicsType::delta);
    place_delta_home(machine);
    // The switch of tower A, at 210°, is higher: its arm hangs steeper, and the nozzle is nearer to
    // it.
    EXPECT_LT(machine.axes[Axis::x].home_position.value(), -0.05);
}

TEST(Kinematics, CoreXyTurnsBothMotorsOneWayForXAndAgainstEachOtherForY) {
    const Kinematics belts{machine_of(KinematicsType::corexy)};
    EXPECT_EQ(belts.motors_from_tool({1, 0, 0, 0}), (AxisValues{1, 1, 0, 0}));
    EXPECT_EQ(belts.motors_from_tool({0, 1, 0, 0}), (AxisValues{1, -1, 0, 0}));
    EXPECT_EQ(belts.stopped_by(Axis::x), 0b0011u);
    EXPECT_EQ(belts.stopped_by(Axis::z), 0b0100u);
}

}  // namespace
}  // namespace qduino::printer::kinematics_property_test
