// The printer and the twin know what their motors move from code that shares nothing. At random
// places both must say the same, and the twin's pieces must be straight enough for its motors.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "printer/kinematics.h"
#include "twin/gantry.h"

namespace qduino::two_gantries_test {
namespace {

struct Pair {
    printer::MachineConfig config;
    twin::Machine machine;
};

Pair pair_of(printer::KinematicsType type) {
    Pair pair;
    pair.config.kinematics = {.type = type,
                              .delta_radius = Millimetres{105},
                              .arm_length = Millimetres{215},
                              .tower_angle_degrees = {211, 329.5, 90}};
    pair.machine.gantry = static_cast<twin::GantryType>(type);
    pair.machine.delta = {105, 215, {211, 329.5, 90}};
    return pair;
}

class TwoGantries : public testing::TestWithParam<printer::KinematicsType> {};

TEST_P(TwoGantries, SayTheSame) {
    const Pair pair = pair_of(GetParam());
    const printer::Kinematics ours{pair.config};
    const twin::Gantry theirs{pair.machine};
    std::mt19937 random{7};
    std::uniform_real_distribution<double> anywhere{-60, 60};
    for (int i = 0; i < 5000; ++i) {
        const twin::Position nozzle{anywhere(random), anywhere(random), 60 + anywhere(random),
                                    anywhere(random)};
        const twin::Position motors = theirs.motors_at(nozzle);
        const printer::AxisValues expected =
            ours.motors_from_tool({nozzle[0], nozzle[1], nozzle[2], nozzle[3]});
        const twin::Position back = theirs.nozzle_at(motors);
        for (std::size_t axis = 0; axis < twin::kAxisCount; ++axis) {
            ASSERT_NEAR(motors[axis], expected[axis], 1e-9);
            ASSERT_NEAR(back[axis], nozzle[axis], 1e-9);
        }
    }
}

TEST_P(TwoGantries, NoMotorLeavesAPieceByMoreThanAsked) {
    const twin::Gantry gantry{pair_of(GetParam()).machine};
    std::mt19937 random{8};
    std::uniform_real_distribution<double> anywhere{-60, 60};
    constexpr double kError = 0.001;
    for (int i = 0; i < 300; ++i) {
        const twin::Position from{anywhere(random), anywhere(random), 60, 0};
        const twin::Position to{anywhere(random), anywhere(random), 60 + anywhere(random), 0};
        const int pieces = gantry.pieces_of(from, to, kError);
        const auto motors_at = [&](double share) {
            twin::Position at{};
            for (std::size_t axis = 0; axis < 3; ++axis)
                at[axis] = from[axis] + share * (to[axis] - from[axis]);
            return gantry.motors_at(at);
        };
        for (int piece = 0; piece < pieces; ++piece) {
            const twin::Position begin = motors_at(double(piece) / pieces);
            const twin::Position middle = motors_at((piece + 0.5) / pieces);
            const twin::Position end = motors_at((piece + 1.0) / pieces);
            for (std::size_t motor = 0; motor < 3; ++motor)
                ASSERT_LE(std::abs(middle[motor] - (begin[motor] + end[motor]) / 2), kError * 1.01);
        }
    }
}

INSTANTIATE_TEST_SUITE_P(All, TwoGantries,
                         testing::Values(printer::KinematicsType::cartesian, printer::KinematicsType::corexy,
                                         printer::KinematicsType::delta));

}  // namespace
}  // namespace qduino::two_gantries_test
