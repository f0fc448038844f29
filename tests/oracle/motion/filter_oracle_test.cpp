// Every step of the reference machine, behind each filter, against dense sampling (motion_judge.h).
#include <gtest/gtest.h>

#include "tests/oracle/motion/motion_judge.h"
#include "tests/property/motion/random_moves.h"

namespace qduino::printer::step::filter_oracle_test {
namespace {

using motion::AxisVector;

MachineConfig machine(ShaperConfig x, ShaperConfig y, double advance_s, double jerk) {
    MachineConfig config;
    config.axes[Axis::x].shaper = x;
    config.axes[Axis::y].shaper = y;
    config.pressure_advance.advance = Seconds{advance_s};
    config.jerk_mm_s3 = jerk;
    config.reversal_gap = 2us;
    return config;
}

void check(std::uint64_t seed, const MachineConfig& config) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const AxisVector start{75, 75, 10, 0};
    test::RandomMoves random(seed, start);
    test::MotionJudge judge(config, start, {});
    for (const motion::Move& move : random.take(test::kJudgedMoves)) judge.append(move);
    const test::Judged judged = judge.finish();
    ASSERT_EQ(judged.wrong, "");
    ASSERT_GT(judged.steps, 10 * test::kJudgedMoves);
    ASSERT_LE(judged.ill_conditioned * 50, judged.steps);
}

TEST(FilterOracle, EveryShaperWithAdvance) {
    std::uint64_t seed = 1;
    for (const ShaperType type :
         {ShaperType::zv, ShaperType::zvd, ShaperType::mzv, ShaperType::ei, ShaperType::two_hump_ei}) {
        check(seed++, machine({type, 40, 0.1}, {type, 55, 0.05}, 0.05, 0));
        if (HasFatalFailure()) return;
    }
}

TEST(FilterOracle, ShapersAlone) {
    for (std::uint64_t seed = 11; seed <= 14; ++seed) {
        check(seed, machine({ShaperType::mzv, 38.5, 0.1}, {ShaperType::ei, 61, 0}, 0, 0));
        if (HasFatalFailure()) return;
    }
}

TEST(FilterOracle, AdvanceAlone) {
    for (std::uint64_t seed = 21; seed <= 24; ++seed) {
        check(seed, machine({}, {}, 0.02 * static_cast<double>(seed - 20), 0));
        if (HasFatalFailure()) return;
    }
}

TEST(FilterOracle, LimitedJerkAlone) {
    for (std::uint64_t seed = 31; seed <= 36; ++seed) {
        check(seed, machine({}, {}, 0, seed % 2 == 0 ? 2e4 : 5e5));
        if (HasFatalFailure()) return;
    }
}

TEST(FilterOracle, EverythingAtOnce) {
    for (std::uint64_t seed = 41; seed <= 44; ++seed) {
        check(seed, machine({ShaperType::two_hump_ei, 50, 0.1}, {ShaperType::zv, 35, 0.2}, 0.08, 1e5));
        if (HasFatalFailure()) return;
    }
}

}  // namespace
}  // namespace qduino::printer::step::filter_oracle_test
