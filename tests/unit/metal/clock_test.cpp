// The kernel's clock and its inverse: an alarm comes neither early nor, after days, late.
#include "board/metal/computer/clock.h"

#include <gtest/gtest.h>

#include <random>

namespace qduino::board::metal::clock_test {
namespace {

constexpr std::uint64_t kOrigin = 123'456'789'012'345;

ComputerClock clock_of(std::uint64_t hz) {
    ComputerClock clock;
    clock.set(hz, kOrigin);
    return clock;
}

void expect_first_count(const ComputerClock& clock, Instant t) {
    const std::uint64_t count = clock.count_at(t);
    ASSERT_GE(clock.instant_at(count), t);
    const bool is_first = count == kOrigin || clock.instant_at(count - 1) < t;
    ASSERT_TRUE(is_first) << to_ns(t);
}

TEST(ComputerClock, CountAtIsTheFirstCountOfAnInstantHoweverLongTheMachineRuns) {
    std::mt19937_64 random{20261126};
    for (const std::uint64_t hz : {1'000'000u, 24'000'000u, 62'500'000u, 200'000'000u, 1'000'000'000u,
                                   2'399'998'761u, 4'200'000'019u}) {
        SCOPED_TRACE(hz);
        const ComputerClock clock = clock_of(hz);
        for (const Nanoseconds length : {Nanoseconds{0}, Nanoseconds{1}, Nanoseconds{1s}})
            expect_first_count(clock, kEpoch + length);
        for (const Nanoseconds longest :
             {Nanoseconds{1ms}, Nanoseconds{1s}, Nanoseconds{1h}, Nanoseconds{30 * 24h}}) {
            for (int i = 0; i < 200; ++i) {
                const auto ns =
                    static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(longest.count()));
                expect_first_count(clock, instant_from_ns(ns));
            }
        }
    }
}

TEST(ComputerClock, KeepsTheRateToAMicrosecondInADay) {
    for (const std::uint64_t hz : {1'000'000u, 200'000'000u, 2'399'998'761u}) {
        const Nanoseconds day = clock_of(hz).instant_at(kOrigin + 86'400 * hz) - kEpoch;
        EXPECT_LE(day, 24h);
        EXPECT_GT(day, 24h - 1us) << hz;
    }
}

TEST(ComputerClock, TheDateIsOneNumberBehindTheCount) {
    ComputerClock clock;
    clock.set(1'000'000'000, clock_count());
    EXPECT_EQ(clock.date_of_instant_0(), Nanoseconds{0});
    clock.set_date(std::nullopt);
    EXPECT_EQ(clock.date_of_instant_0(), Nanoseconds{0});
    constexpr Nanoseconds kDate = std::chrono::seconds{1'772'323'198};
    const Instant before = clock.now();
    clock.set_date(kDate / 1s);
    const Instant behind = clock.now();
    EXPECT_LE(clock.date_of_instant_0(), kDate - (before - kEpoch));
    EXPECT_GE(clock.date_of_instant_0(), kDate - (behind - kEpoch));
}

}  // namespace
}  // namespace qduino::board::metal::clock_test
