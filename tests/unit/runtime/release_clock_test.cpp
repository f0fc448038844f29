#include "runtime/release_clock.h"

#include <gtest/gtest.h>

#include <random>

namespace qduino::runtime::release_clock_test {
namespace {

constexpr Instant at(Nanoseconds since) { return kEpoch + since; }

TEST(ReleaseClock, ReleaseKIsDueAtOriginPlusKPeriods) {
    ReleaseClock clock(at(7ms), 10ms, at(7ms));
    EXPECT_EQ(clock.nominal(), at(7ms));
    for (int k = 1; k <= 1000; ++k) {
        // Anywhere in the period.
        const Instant ended = clock.nominal() + Nanoseconds{k * 7919 % 10'000'000};
        const Release release = clock.next(ended, OverrunPolicy::skip);
        EXPECT_EQ(release.nominal, at(7ms + 10ms * k));
        EXPECT_FALSE(release.overrun());
    }
}

TEST(ReleaseClock, EndingExactlyWhenTheNextIsDueIsNoOverrun) {
    ReleaseClock clock(at(0ms), 10ms, at(0ms));
    EXPECT_FALSE(clock.next(at(10ms), OverrunPolicy::skip).overrun());
    const Release late = clock.next(at(20ms + 1ns), OverrunPolicy::skip);
    EXPECT_TRUE(late.overrun());
    EXPECT_EQ(late.lateness, Nanoseconds{1});
    EXPECT_EQ(late.nominal, at(30ms));
    EXPECT_EQ(late.dropped, 1);
}

TEST(ReleaseClock, SkipGoesOnAtTheNextNominalInstant) {
    ReleaseClock clock(at(0ms), 10ms, at(0ms));
    const Release release = clock.next(at(47ms), OverrunPolicy::skip);
    EXPECT_EQ(release.lateness, Nanoseconds{37ms});
    EXPECT_EQ(release.nominal, at(50ms));
    EXPECT_EQ(release.dropped, 4);  // those of 10, 20, 30 and 40 ms
    EXPECT_EQ(clock.next(at(51ms), OverrunPolicy::skip).nominal, at(60ms));
}

TEST(ReleaseClock, SkipRunsTheReleaseThatIsDueJustNow) {
    ReleaseClock clock(at(0ms), 10ms, at(0ms));
    const Release release = clock.next(at(40ms), OverrunPolicy::skip);
    EXPECT_EQ(release.nominal, at(40ms));
    EXPECT_EQ(release.dropped, 3);
}

TEST(ReleaseClock, CatchUpDropsNothing) {
    ReleaseClock clock(at(0ms), 10ms, at(0ms));
    std::vector<Instant> nominal;
    Instant now = at(47ms);
    for (int i = 0; i < 6; ++i) {
        const Release release = clock.next(now, OverrunPolicy::catch_up);
        nominal.push_back(release.nominal);
        EXPECT_EQ(release.dropped, 0);
        now = std::max(now, release.nominal) + 1ms;
    }
    EXPECT_EQ(nominal, (std::vector<Instant>{at(10ms), at(20ms), at(30ms), at(40ms), at(50ms), at(60ms)}));
}

TEST(ReleaseClock, AThreadThatComesUpLateJoinsTheGrid) {
    ReleaseClock clock(at(0ms), 10ms, at(34ms));
    EXPECT_EQ(clock.nominal(), at(30ms));
    EXPECT_EQ(clock.next(at(36ms), OverrunPolicy::skip).nominal, at(40ms));
}

TEST(ReleaseClock, AnyHistoryStaysOnTheGrid) {
    for (std::uint64_t seed = 1; seed <= 50; ++seed) {
        std::mt19937_64 random(seed);
        const Nanoseconds period{1 + static_cast<std::int64_t>(random() % 1'000'000)};
        const Instant origin = at(Nanoseconds{static_cast<std::int64_t>(random() % 1'000'000)});
        ReleaseClock clock(origin, period, origin);
        Instant now = origin;
        std::int64_t index = 0;
        for (int i = 0; i < 1000; ++i) {
            const auto policy = static_cast<OverrunPolicy>(random() % 3);
            now += period * static_cast<std::int64_t>(random() % 300) / 100;
            const Release release = clock.next(now, policy);
            index += 1 + release.dropped;
            ASSERT_EQ(release.nominal, origin + index * period) << "seed " << seed;
            ASSERT_EQ(release.overrun(), now > origin + (index - release.dropped) * period)
                << "seed " << seed;
            if (policy != OverrunPolicy::catch_up) {
                ASSERT_GE(release.nominal, now) << "seed " << seed;
                ASSERT_LT(release.nominal, now + period + period) << "seed " << seed;
            }
            now = std::max(now, release.nominal);
        }
    }
}

}  // namespace
}  // namespace qduino::runtime::release_clock_test
