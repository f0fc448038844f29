// Every step of CoreXY and delta machines against dense sampling (motion_judge.h): the
// same steps in the same order, each within 50 ns, with and without shapers, pressure advance and a
// bounded jerk.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "tests/oracle/motion/motion_judge.h"

namespace qduino::printer::step::kinematics_oracle_test {
namespace {

using motion::AxisVector;

constexpr double kReach_mm = 85;

MachineConfig machine_of(KinematicsType type) {
    MachineConfig config;
    config.kinematics.type = type;
    for (const Axis axis : {Axis::x, Axis::y, Axis::z}) {
        config.axes[axis].steps_per_mm = 100;
        config.axes[axis].max_speed = 200_mm_s;
        config.axes[axis].max_acceleration = 4000_mm_s2;
    }
    if (type != KinematicsType::delta) return config;
    config.kinematics.arm_length = Millimetres{250};
    config.kinematics.delta_radius = Millimetres{125};
    config.kinematics.bed_radius = Millimetres{90};
    config.kinematics.home_height = Millimetres{300};
    config.kinematics.tower_angle_degrees = {211, 329.5, 90};
    return config;
}

/// What makes carriages turn: lines across, hairpins, curves of tiny moves, hops, retractions.
class Moves {
  public:
    explicit Moves(std::uint64_t seed) : random_(seed) {}

    [[nodiscard]] const AxisVector& at() const { return at_; }
    std::vector<motion::Move> take(std::size_t count) {
        std::vector<motion::Move> moves;
        while (moves.size() < count) {
            const double speed = uniform(20, 180);
            switch (static_cast<int>(uniform(0, 6))) {
                case 0:
                    go(moves, uniform(-30, 30), uniform(-30, 30), 0, 0, speed);
                    break;
                case 1:
                    curve(moves, speed);
                    break;
                case 2:
                    hairpin(moves, speed);
                    break;
                case 3:
                    go(moves, 0, 0, uniform(-0.6, 0.6), 0, speed);
                    break;
                case 4:
                    go(moves, 0, 0, 0, uniform(-0.4, 0.4), speed);
                    break;
                default:
                    go(moves, uniform(-8, 8), uniform(-8, 8), uniform(-0.2, 0.2), uniform(0, 0.2), speed);
            }
        }
        moves.resize(count);
        return moves;
    }

  private:
    double uniform(double low, double high) { return std::uniform_real_distribution{low, high}(random_); }
    void go(std::vector<motion::Move>& moves, double dx, double dy, double dz, double e, double speed) {
        if (std::hypot(at_[0] + dx, at_[1] + dy) > kReach_mm) dx = -dx, dy = -dy;
        const auto on_grid = [](double mm) { return std::round(mm * 1000) / 1000; };
        at_ = {on_grid(at_[0] + dx), on_grid(at_[1] + dy), on_grid(std::max(at_[2] + dz, 0.0)), 0};
        moves.push_back({{at_[0], at_[1], at_[2]}, e, speed, uniform(500, 4000)});
    }
    void curve(std::vector<motion::Move>& moves, double speed) {
        const double length = uniform(0.02, 0.6), turn = uniform(-0.4, 0.4);
        double heading = uniform(0, 6.3);
        for (int i = 0; i < 20; ++i, heading += turn)
            go(moves, length * std::cos(heading), length * std::sin(heading), 0, 0.033 * length, speed);
    }
    void hairpin(std::vector<motion::Move>& moves, double speed) {
        const double length = uniform(0.1, 3), heading = uniform(0, 6.3), beside = uniform(0.01, 0.5);
        for (int i = 0; i < 4; ++i) {
            const double way = i % 2 == 0 ? length : -length;
            go(moves, way * std::cos(heading), way * std::sin(heading), 0, 0.033 * length, speed);
            go(moves, -beside * std::sin(heading), beside * std::cos(heading), 0, 0.033 * beside, speed);
        }
    }

    std::mt19937_64 random_;
    AxisVector at_{0, 0, 10, 0};
};

void check(std::uint64_t seed, const MachineConfig& config) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Moves random(seed);
    test::MotionJudge judge(config, random.at(), {});
    for (const motion::Move& move : random.take(test::kJudgedMoves)) judge.append(move);
    const test::Judged judged = judge.finish();
    ASSERT_EQ(judged.wrong, "");
    ASSERT_GT(judged.steps, 20 * test::kJudgedMoves);
    ASSERT_LE(judged.ill_conditioned * 50, judged.steps);
}

class KinematicsOracle : public testing::TestWithParam<KinematicsType> {
  protected:
    MachineConfig config_ = machine_of(GetParam());
    void check_seeds(std::uint64_t first, std::uint64_t last) {
        for (std::uint64_t seed = first; seed <= last && !HasFatalFailure(); ++seed) check(seed, config_);
    }
};

TEST_P(KinematicsOracle, PlainMotion) { check_seeds(1, 2); }

TEST_P(KinematicsOracle, OnlyIllegalPairsLeftOut) {
    config_.reversal_gap = 2us;
    check_seeds(11, 12);
}

TEST_P(KinematicsOracle, EveryShaperWithAdvance) {
    std::uint64_t seed = 21;
    for (const ShaperType type :
         {ShaperType::zv, ShaperType::zvd, ShaperType::mzv, ShaperType::ei, ShaperType::two_hump_ei}) {
        config_.axes[Axis::x].shaper = {type, 42, 0.1};
        config_.axes[Axis::y].shaper = {type, 57, 0.05};
        config_.pressure_advance.advance = Seconds{0.05};
        check(seed++, config_);
        if (HasFatalFailure()) return;
    }
}

TEST_P(KinematicsOracle, ABoundedJerk) {
    config_.jerk_mm_s3 = 1e5;
    check_seeds(31, 32);
}

TEST_P(KinematicsOracle, EverythingAtOnce) {
    config_.axes[Axis::x].shaper = {ShaperType::two_hump_ei, 50, 0.1};
    config_.axes[Axis::y].shaper = {ShaperType::mzv, 35, 0.2};
    config_.pressure_advance.advance = Seconds{0.08};
    config_.jerk_mm_s3 = 1e5;
    check_seeds(41, 42);
}

std::string name_of(const testing::TestParamInfo<KinematicsType>& kind) {
    return kind.param == KinematicsType::corexy ? "CoreXY" : "Delta";
}
INSTANTIATE_TEST_SUITE_P(Each, KinematicsOracle,
                         testing::Values(KinematicsType::corexy, KinematicsType::delta), name_of);

}  // namespace
}  // namespace qduino::printer::step::kinematics_oracle_test
