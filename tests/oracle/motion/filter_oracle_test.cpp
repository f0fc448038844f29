// Every step of filtered motion against dense numerical integration (sampled_motion.h).
//
// An instant is right when the sampled position crosses the half-step within 50 ns of it. Where the
// motor nearly stands that asks for more than numbers can hold: a rounding error of the place is
// 1e-13 mm, and at 1 µm/s that is 0.1 ns, but where the speed passes through 0 any instant will do.
// There the place itself is asked to be right, to a millionth of a step.
//
// That no step is missing: between steps, the count is the sampled position, rounded, but for pairs
// there and back that are too near.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/oracle/motion/sampled_motion.h"
#include "tests/property/motion/pipeline.h"
#include "tests/property/motion/random_moves.h"

namespace qduino::printer::step::filter_oracle_test {
namespace {

using motion::AxisVector;
using test::Real;
using test::SampledMotion;

constexpr Real kInstant_s = 50e-9L;
constexpr Real kPlaceSteps = 1e-6L;
constexpr Nanoseconds kGap = 2us;

MachineConfig machine(ShaperConfig x, ShaperConfig y, double advance_s, double jerk) {
    MachineConfig config;
    config.axes[Axis::x].shaper = x;
    config.axes[Axis::y].shaper = y;
    config.pressure_advance.advance = Seconds{advance_s};
    config.jerk_mm_s3 = jerk;
    config.reversal_gap = kGap;
    return config;
}

/// How much later than planned everything is played: as far as filters look ahead.
Real lead_s(const motion::MotionFilters& filters) {
    Real ahead = filters.smooth_time.value() / 2;
    for (const ShaperConfig& shaper : filters.shapers)
        ahead = std::max(ahead, -test::SampledShaper{shaper}.delay_s.front());
    return std::ceil(ahead * 1e9L) * 1e-9L;
}

struct Checked {
    std::size_t steps = 0;
    std::size_t ill_conditioned = 0;
};

void check_axis(const test::Pipeline& pipeline, const SampledMotion& sampled, const MachineConfig& config,
                std::size_t axis, std::int64_t count, Checked& checked) {
    const Real per_mm = config.axes[axis].steps_per_mm;
    const Real lead = lead_s(motion::motion_settings(config).filters);
    const auto steps_at = [&](Real s) { return per_mm * sampled.position(axis, s - lead); };
    Real before_s = 0;
    for (const StepEvent& event : pipeline.events) {
        if (event.kind != EventKind::step || event.axis != axis) continue;
        const Real at_s = static_cast<Real>(event.time_ns) * 1e-9L;
        const Real half = static_cast<Real>(count) + Real{0.5} * event.direction;
        const Real early = (steps_at(at_s - kInstant_s) - half) * event.direction;
        const Real late = (steps_at(at_s + kInstant_s) - half) * event.direction;
        ++checked.steps;
        if (early > 0 || late < 0) {
            ++checked.ill_conditioned;
            ASSERT_LE(std::abs(static_cast<double>(steps_at(at_s) - half)), static_cast<double>(kPlaceSteps))
                << "axis " << axis << " at " << event.time_ns << " ns";
        }
        // In the middle of two steps the count is the place, rounded.
        const Real between = steps_at((before_s + at_s) / 2);
        ASSERT_NEAR(static_cast<double>(between), static_cast<double>(count), 0.5 + 0.01)
            << "axis " << axis << " before " << event.time_ns << " ns";
        count += event.direction;
        before_s = at_s;
    }
    ASSERT_EQ(count, pipeline.solver.counts()[axis]);
}

void check(std::uint64_t seed, std::size_t moves, const MachineConfig& config) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const AxisVector start{75, 75, 10, 0};
    test::RandomMoves random(seed, start);
    test::Pipeline pipeline(config, start);
    const auto counts = pipeline.solver.counts();
    for (const motion::Move& move : random.take(moves)) pipeline.append(move);
    pipeline.finish();
    ASSERT_FALSE(pipeline.segments.empty());
    const SampledMotion sampled(pipeline.segments, motion::motion_settings(config).filters);
    Checked checked;
    for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
        check_axis(pipeline, sampled, config, axis, counts[axis], checked);
        if (::testing::Test::HasFatalFailure()) return;
    }
    ASSERT_GT(checked.steps, 1000u);
    ASSERT_LE(checked.ill_conditioned * 50, checked.steps);
    ASSERT_EQ(pipeline.events.back().kind, EventKind::rest);
}

TEST(FilterOracle, EveryShaperWithAdvance) {
    std::uint64_t seed = 1;
    for (const ShaperType type :
         {ShaperType::zv, ShaperType::zvd, ShaperType::mzv, ShaperType::ei, ShaperType::two_hump_ei}) {
        check(seed++, 300, machine({type, 40, 0.1}, {type, 55, 0.05}, 0.05, 0));
        if (HasFatalFailure()) return;
    }
}

TEST(FilterOracle, ShapersAlone) {
    for (std::uint64_t seed = 11; seed <= 14; ++seed) {
        check(seed, 300, machine({ShaperType::mzv, 38.5, 0.1}, {ShaperType::ei, 61, 0}, 0, 0));
        if (HasFatalFailure()) return;
    }
}

TEST(FilterOracle, AdvanceAlone) {
    for (std::uint64_t seed = 21; seed <= 24; ++seed) {
        check(seed, 300, machine({}, {}, 0.02 * static_cast<double>(seed - 20), 0));
        if (HasFatalFailure()) return;
    }
}

TEST(FilterOracle, LimitedJerkAlone) {
    for (std::uint64_t seed = 31; seed <= 36; ++seed) {
        check(seed, 300, machine({}, {}, 0, seed % 2 == 0 ? 2e4 : 5e5));
        if (HasFatalFailure()) return;
    }
}

TEST(FilterOracle, EverythingAtOnce) {
    for (std::uint64_t seed = 41; seed <= 44; ++seed) {
        check(seed, 300, machine({ShaperType::two_hump_ei, 50, 0.1}, {ShaperType::zv, 35, 0.2}, 0.08, 1e5));
        if (HasFatalFailure()) return;
    }
}

}  // namespace
}  // namespace qduino::printer::step::filter_oracle_test
