// The look-ahead against a planner that knows nothing of passes, laziness or queues. It takes all
// moves at once, writes every limit down as the textbook does, and lowers speeds until no rule is
// broken any more.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "printer/motion/planner.h"
#include "tests/property/motion/pipeline.h"
#include "tests/property/motion/random_moves.h"

namespace qduino::printer::motion::planner_oracle_test {
namespace {

struct OracleMove {
    AxisVector delta{};
    double length = 0;
    bool in_space = true;
    double speed = 0, acceleration = 0, asked_acceleration = 0;
};

OracleMove understand(const AxisVector& from, const Move& move, const MotionSettings& settings) {
    OracleMove result;
    for (std::size_t i = 0; i < 3; ++i) result.delta[i] = move.end_mm[i] - from[i];
    result.delta[3] = move.filament_mm;
    result.length = std::hypot(result.delta[0], result.delta[1], result.delta[2]);
    result.in_space = result.length >= 1e-9;
    if (!result.in_space) result.length = std::abs(result.delta[3]);
    result.speed = std::max(move.speed_mm_s, 0.01);
    result.acceleration = result.asked_acceleration = move.acceleration_mm_s2;
    if (result.length < 1e-9) return result;
    // Whatever the path does, each axis moves |delta|/length times as fast.
    for (std::size_t i = 0; i < kAxisCount; ++i) {
        if (result.delta[i] == 0) continue;
        const double share = std::abs(result.delta[i]) / result.length;
        while (result.speed * share > settings.max_speed[i].value() * (1 + 1e-12)) {
            result.speed = settings.max_speed[i].value() / share;
        }
        result.acceleration = std::min(result.acceleration, settings.max_acceleration[i].value() / share);
    }
    return result;
}

/// Square of the speed allowed where `a` ends and `b` begins.
double corner(const OracleMove& a, const OracleMove& b, const MotionSettings& settings) {
    if (a.in_space != b.in_space) return 0;
    double limit2 = std::pow(std::min(a.speed, b.speed), 2);
    double dot = 0;
    if (a.in_space) {
        for (std::size_t i = 0; i < 3; ++i) dot += a.delta[i] * b.delta[i] / (a.length * b.length);
    } else {
        dot = a.delta[3] * b.delta[3] / (a.length * b.length);
    }
    const double cos_theta = std::clamp(-dot, -1.0, 1.0);
    const double s = std::sqrt(0.5 * (1 - cos_theta)), c = std::sqrt(0.5 * (1 + cos_theta));
    if (s < 1 - 1e-12) {  // else straight on
        for (const OracleMove* move : {&a, &b}) {
            const double scv = settings.square_corner_speed.value();
            const double deviation = scv * scv * (std::sqrt(2.0) - 1) / move->asked_acceleration;
            limit2 = std::min(limit2, move->acceleration * deviation * s / (1 - s));
            limit2 = std::min(limit2, 0.5 * move->length * move->acceleration * s / c);
        }
    }
    for (const std::size_t i : {2u, 3u}) {
        const double change = std::abs(a.delta[i] / a.length - b.delta[i] / b.length);
        if (change > 0)
            limit2 = std::min(limit2, std::pow(settings.instantaneous_speed[i].value() / change, 2));
    }
    return limit2;
}

/// Squares of the speeds at all nodes, 0 at both ends.
std::vector<double> relax(const std::vector<OracleMove>& moves, const MotionSettings& settings) {
    std::vector<double> speed2(moves.size() + 1, 0);
    for (std::size_t i = 1; i < moves.size(); ++i) speed2[i] = corner(moves[i - 1], moves[i], settings);
    for (bool changed = true; changed;) {
        changed = false;
        for (std::size_t i = 0; i < moves.size(); ++i) {
            const double gain = 2 * moves[i].acceleration * moves[i].length;
            for (const auto& [here, there] : {std::pair{i, i + 1}, {i + 1, i}}) {
                if (speed2[here] <= speed2[there] + gain) continue;
                speed2[here] = speed2[there] + gain;
                changed = true;
            }
        }
    }
    return speed2;
}

void check_against_oracle(std::uint64_t seed, std::size_t count, bool lazily) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const AxisVector start{75, 75, 10, 0};
    test::RandomMoves random(seed, start);
    const std::vector<Move> moves = random.take(count);
    test::Pipeline pipeline(MachineConfig{}, start);
    const MotionSettings settings = pipeline.planner->settings();
    std::vector<OracleMove> understood;
    AxisVector at = start;
    for (const Move& move : moves) {
        const OracleMove next = understand(at, move, settings);
        if (next.length >= 1e-9) understood.push_back(next);
        at = {move.end_mm[0], move.end_mm[1], move.end_mm[2], 0};
        pipeline.append(move);
        if (lazily) pipeline.pump();
    }
    pipeline.finish();
    const std::vector<double> expected2 = relax(understood, settings);
    ASSERT_EQ(pipeline.segments.size(), understood.size());
    for (std::size_t i = 0; i < understood.size(); ++i) {
        const Trapezoid& shape = pipeline.segments[i].shape;
        // Squares are compared: the textbook's √½(1−cosθ) is noise of 1e-8 where the path turns
        // right back.
        ASSERT_NEAR(std::pow(shape.entry_speed_mm_s, 2), expected2[i], 1e-5 + 1e-8 * expected2[i])
            << "move " << i;
        ASSERT_NEAR(std::pow(shape.exit_speed_mm_s, 2), expected2[i + 1], 1e-5 + 1e-8 * expected2[i + 1])
            << "move " << i;
        ASSERT_NEAR(shape.acceleration_mm_s2, understood[i].acceleration, 1e-6 * understood[i].acceleration);
        ASSERT_LE(shape.cruise_speed_mm_s, understood[i].speed * (1 + 1e-9));
        const double room2 =
            0.5 * (expected2[i] + expected2[i + 1]) + understood[i].acceleration * understood[i].length;
        ASSERT_NEAR(shape.cruise_speed_mm_s, std::min(understood[i].speed, std::sqrt(room2)), 1e-4)
            << "move " << i;
    }
}

TEST(PlannerOracle, SameSpeedsWhenPlannedAtOnce) {
    for (std::uint64_t seed = 1; seed <= 400; ++seed) {
        check_against_oracle(seed, 2 + seed % 60, false);
        if (HasFatalFailure()) return;
    }
}

TEST(PlannerOracle, SameSpeedsWhenTakenAsSoonAsTheyAreFinal) {
    for (std::uint64_t seed = 1001; seed <= 1400; ++seed) {
        check_against_oracle(seed, 2 + seed % 60, true);
        if (HasFatalFailure()) return;
    }
}

TEST(PlannerOracle, SameSpeedsOverLongListsTakenLazily) {
    for (std::uint64_t seed = 2001; seed <= 2004; ++seed) {
        check_against_oracle(seed, 400, true);
        if (HasFatalFailure()) return;
    }
}

}  // namespace
}  // namespace qduino::printer::motion::planner_oracle_test
