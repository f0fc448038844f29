// The melt against small steps of its differential equation, on random pushes. Every failure names
// its seed.
#include "twin/melt.h"

#include <gtest/gtest.h>

#include <random>

namespace qduino::twin::melt_property_test {
namespace {

constexpr double kStepMm3 = 0.025;

/// The same physics as brute force: Euler's method in steps of a few microseconds, and the flow as
/// the drawing in melt.h has it.
class Oracle {
  public:
    explicit Oracle(const MeltSpec& spec) : spec_(spec), stored_(-spec.idle_ooze_mm3) {}

    void push(std::int64_t now_ns, int direction) {
        pass_to(now_ns);
        const double interval = std::clamp(static_cast<double>(now_ns - pushed_ns_) * 1e-9, 1e-9, 0.1);
        pushed_ns_ = now_ns;
        to_push_ += direction * kStepMm3;
        pace_ = to_push_ / interval;
    }
    void pass_to(std::int64_t now_ns) {
        constexpr std::int64_t kDt = 4000;
        while (now_ns_ < now_ns) {
            const std::int64_t dt_ns = std::min(kDt, now_ns - now_ns_);
            now_ns_ += dt_ns;
            const double dt = static_cast<double>(dt_ns) * 1e-9;
            double pushed = pace_ * dt;
            if (std::abs(pushed) > std::abs(to_push_)) pushed = to_push_;
            to_push_ -= pushed;
            const double flows = flow() * dt;
            left_ += flows;
            stored_ += pushed - flows;
        }
    }
    [[nodiscard]] double left() const { return left_; }
    [[nodiscard]] double stored() const { return stored_; }

  private:
    [[nodiscard]] double flow() const {
        if (stored_ <= -spec_.idle_ooze_mm3) return 0;
        if (stored_ <= 0) return (stored_ + spec_.idle_ooze_mm3) / spec_.idle_ooze_s;
        return stored_ / spec_.pressure_s + spec_.idle_ooze_mm3 / spec_.idle_ooze_s;
    }
    MeltSpec spec_;
    double stored_, to_push_ = 0, pace_ = 0, left_ = 0;
    std::int64_t now_ns_ = 0, pushed_ns_ = -100'000'000;
};

/// Bursts of pushes at one pace, retractions and their returns, and pauses.
class RandomPushes {
  public:
    explicit RandomPushes(std::uint64_t seed) : random_(seed) {}

    template <typename Push>
    void play(Push push) {
        for (int burst = 0; burst < 12; ++burst) {
            const bool back = drawn_ == 0 && number(0, 1) < 0.3;
            const int direction = back ? -1 : 1;
            const int count = drawn_ > 0 ? drawn_ : 5 + static_cast<int>(number(0, 60));
            const double interval = back || drawn_ > 0 ? 300'000 : number(1e6, 2e7);
            drawn_ = back ? count : 0;
            for (int i = 0; i < count; ++i) {
                now_ += static_cast<std::int64_t>(interval);
                pushed_mm3 += direction * kStepMm3;
                push(now_, direction);
            }
            now_ += static_cast<std::int64_t>(number(0, 1) < 0.4 ? number(0, 1.5e9) : number(0, 1e7));
        }
    }
    double number(double from, double to) { return std::uniform_real_distribution<>(from, to)(random_); }
    double pushed_mm3 = 0;
    [[nodiscard]] std::int64_t now() const { return now_; }

  private:
    std::mt19937_64 random_;
    std::int64_t now_ = 0;
    int drawn_ = 0;
};

TEST(MeltProperty, FlowsAsSmallStepsOfItsEquationDo) {
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
        RandomPushes pushes(seed);
        const MeltSpec spec{.pressure_s = pushes.number(0.01, 0.2),
                            .idle_ooze_mm3 = seed % 4 == 0 ? 0 : pushes.number(0.05, 1),
                            .idle_ooze_s = pushes.number(0.5, 5)};
        Melt melt(spec, kStepMm3);
        Oracle oracle(spec);
        double left = 0;
        pushes.play([&](std::int64_t now, int direction) {
            oracle.push(now, direction);
            melt.push(instant_from_ns(now), direction);
            const double took = melt.take(instant_from_ns(now));
            EXPECT_GE(took, 0) << "seed " << seed;
            left += took;
            ASSERT_NEAR(left, oracle.left(), 2e-3) << "seed " << seed << " at " << now;
            ASSERT_NEAR(melt.stored_mm3(), oracle.stored(), 2e-3) << "seed " << seed << " at " << now;
        });
    }
}

TEST(MeltProperty, NothingIsLostAndManyLooksSeeWhatOneSees) {
    for (std::uint64_t seed = 1; seed <= 50; ++seed) {
        RandomPushes pushes(seed);
        const MeltSpec spec{};
        Melt often(spec, kStepMm3), seldom(spec, kStepMm3);
        double left = 0;
        std::int64_t last = 0;
        pushes.play([&](std::int64_t now, int direction) {
            for (int i = 1; i <= 3; ++i) left += often.take(instant_from_ns(last + (now - last) * i / 3));
            last = now;
            often.push(instant_from_ns(now), direction);
            seldom.push(instant_from_ns(now), direction);
        });
        const Instant end = instant_from_ns(pushes.now() + 30'000'000'000);
        left += often.take(end);
        EXPECT_NEAR(left, seldom.take(end), 1e-9) << "seed " << seed;
        EXPECT_NEAR(pushes.pushed_mm3, left + often.stored_mm3() + spec.idle_ooze_mm3 + often.to_push_mm3(),
                    1e-9)
            << "seed " << seed;
    }
}

TEST(Melt, ASteadyPushLeavesAtItsOwnPace) {
    Melt melt({}, kStepMm3);
    for (int i = 1; i <= 400; ++i) melt.push(instant_from_ns(i * 5'000'000), 1);
    static_cast<void>(melt.take(instant_from_ns(2'000'000'000)));
    melt.push(instant_from_ns(2'005'000'000), 1);
    EXPECT_NEAR(melt.take(instant_from_ns(2'005'000'000)), kStepMm3, 1e-6);
    EXPECT_NEAR(melt.stored_mm3(), 0.05 * (5 - 0.03), 1e-4) << "pressure_s times what flows, less idle ooze";
}

TEST(Melt, ARetractionEndsTheFlowAndAColdNozzleHasNone) {
    Melt melt({}, kStepMm3);
    for (int i = 1; i <= 200; ++i) melt.push(instant_from_ns(i * 5'000'000), 1);
    for (int i = 1; i <= 77; ++i) melt.push(instant_from_ns(1'000'000'000 + i * 300'000), -1);
    static_cast<void>(melt.take(instant_from_ns(1'100'000'000)));
    EXPECT_EQ(melt.take(instant_from_ns(9'000'000'000)), 0);
    for (int i = 1; i <= 300; ++i) melt.push(instant_from_ns(9'000'000'000 + i * 300'000), 1);
    const Instant cold = instant_from_ns(9'100'000'000);
    melt.set_hot(cold, false);
    static_cast<void>(melt.take(cold));
    EXPECT_EQ(melt.take(cold + 10s), 0);
}

}  // namespace
}  // namespace qduino::twin::melt_property_test
