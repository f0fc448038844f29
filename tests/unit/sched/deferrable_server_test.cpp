#include "sched/deferrable_server.h"

#include <gtest/gtest.h>

#include <random>

namespace qduino::sched::deferrable_server_test {
namespace {

constexpr Instant at(std::int64_t ns) { return instant_from_ns(ns); }
constexpr Nanoseconds ns(std::int64_t count) { return Nanoseconds{count}; }

TEST(DeferrableServer, TheDrawingOfItsHead) {
    DeferrableServer server{{3ns, 10ns}};
    server.unblock(at(0));
    server.block(at(0));  // sleeps
    server.unblock(at(7));
    EXPECT_EQ(server.available(at(7)), 6ns);
    EXPECT_EQ(server.consume(at(10), 3ns), 0ns);
    EXPECT_EQ(server.available(at(10)), 3ns);  // at once
    EXPECT_EQ(server.consume(at(13), 3ns), 0ns);
    EXPECT_EQ(server.available(at(13)), 0ns);
    EXPECT_EQ(server.next_replenishment(), at(20));
}

TEST(DeferrableServer, ItsPeriodsBeginWithTheLoopsReleases) {
    DeferrableServer server{{3ns, 10ns}};
    server.unblock(at(0));
    server.consume(at(3), 3ns);
    server.block(at(3));
    server.unblock(at(14));
    EXPECT_EQ(server.available(at(14)), 3ns);
    server.consume(at(17), 3ns);
    EXPECT_EQ(server.next_replenishment(), at(24));
}

TEST(DeferrableServer, ItsFirstPeriodBeginsWithItsFirstWork) {
    DeferrableServer server{{6ns, 10ns}, at(0)};
    server.unblock(at(5));
    EXPECT_EQ(server.available(at(5)), 6ns)
        << "not the next budget as well, which a board would give in one piece";
    EXPECT_EQ(server.consume(at(11), 6ns), 0ns);
    EXPECT_EQ(server.available(at(11)), 0ns);
    EXPECT_EQ(server.next_replenishment(), at(15));
}

TEST(DeferrableServer, WakingWithinAPeriodBringsNothing) {
    DeferrableServer server{{3ns, 10ns}};
    server.unblock(at(0));
    server.consume(at(2), 2ns);
    server.block(at(2));
    server.unblock(at(8));
    EXPECT_EQ(server.available(at(8)), 1ns);
}

TEST(DeferrableServer, AtTheEndOfAPeriodTheNextBudgetFollows) {
    DeferrableServer server{{6ns, 10ns}};
    server.unblock(at(0));
    EXPECT_EQ(server.available(at(8)), 8ns);
    EXPECT_EQ(server.consume(at(11), 3ns), 0ns);
    EXPECT_EQ(server.available(at(11)), 5ns);  // the 4 ns that it left are gone
}

TEST(DeferrableServer, APeriodOfWhichAnOverrunLeftTooLittleIsWaitedOut) {
    DeferrableServer server{{4ns, 10ns}, at(0), 3ns};
    server.unblock(at(0));
    EXPECT_EQ(server.consume(at(6), 6ns), 2ns);
    EXPECT_EQ(server.next_replenishment(), at(20)) << "at 10 it would have 2";
    EXPECT_EQ(server.available(at(20)), 4ns);
    EXPECT_EQ(server.consume(at(25), 5ns), 1ns);
    EXPECT_EQ(server.next_replenishment(), at(30)) << "3 will do";
}

TEST(DeferrableServer, AnOverrunIsPaidOutOfThePeriodsToCome) {
    DeferrableServer server{{3ns, 10ns}};
    server.unblock(at(0));
    EXPECT_EQ(server.consume(at(8), 8ns), 5ns);
    EXPECT_EQ(server.available(at(8)), 0ns);
    EXPECT_EQ(server.available(at(10)), 0ns);  // −5 + 3
    EXPECT_EQ(server.next_replenishment(), at(20));
    EXPECT_EQ(server.available(at(20)), 1ns);  // −5 + 6
    EXPECT_EQ(server.available(at(30)), 3ns);
    EXPECT_EQ(server.consumed(), 8ns);
}

/// A budget is charged alike in one piece and ns by ns, and is gone after what available() said.
TEST(DeferrableServer, PiecesDoNotMatter) {
    for (std::uint64_t seed = 1; seed <= 2000; ++seed) {
        std::mt19937_64 random{seed};
        const auto pick = [&](std::int64_t low, std::int64_t high) {
            return std::uniform_int_distribution<std::int64_t>{low, high}(random);
        };
        const std::int64_t period = pick(2, 20), budget = pick(1, period - 1);
        DeferrableServer whole{{ns(budget), ns(period)}};
        std::int64_t now = pick(0, 30);
        whole.unblock(at(now));
        for (int piece = 0; piece < 6; ++piece) {
            DeferrableServer ticks = whole;
            const std::int64_t promised = whole.available(at(now)).count();
            const std::int64_t used = pick(0, promised + 3);
            const Nanoseconds overrun = whole.consume(at(now + used), ns(used));
            Nanoseconds of_ticks{0};
            for (std::int64_t tick = 0; tick < used; ++tick) {
                if (tick <= promised) {
                    ASSERT_EQ(ticks.available(at(now + tick)).count(), promised - tick) << "seed " << seed;
                }
                of_ticks += ticks.consume(at(now + tick + 1), 1ns);
            }
            now += used;
            ASSERT_EQ(overrun, of_ticks) << "seed " << seed;
            ASSERT_EQ(whole.available(at(now)), ticks.available(at(now))) << "seed " << seed;
            ASSERT_EQ(whole.next_replenishment(), ticks.next_replenishment()) << "seed " << seed;
            now += pick(0, period);
        }
    }
}

/// Whatever a loop does, each of its periods gives it one budget, a window of a period at most two.
TEST(DeferrableServer, NoWindowOfAPeriodHasMoreThanTwoBudgets) {
    for (std::uint64_t seed = 1; seed <= 300; ++seed) {
        std::mt19937_64 random{seed};
        const auto pick = [&](std::int64_t low, std::int64_t high) {
            return std::uniform_int_distribution<std::int64_t>{low, high}(random);
        };
        const std::int64_t period = pick(2, 20), budget = pick(1, period);
        DeferrableServer server{{ns(budget), ns(period)}};
        std::vector<std::int64_t> ran;
        for (std::int64_t now = 0; now < 400; ++now) {
            if (pick(0, 3) == 0) server.blocked() ? server.unblock(at(now)) : server.block(at(now));
            if (server.blocked() || server.available(at(now)) == 0ns || pick(0, 2) == 0) continue;
            EXPECT_EQ(server.consume(at(now + 1), 1ns), 0ns);
            ran.push_back(now);
        }
        for (std::size_t first = 0; first < ran.size(); ++first) {
            const auto end = std::lower_bound(ran.begin(), ran.end(), ran[first] + period);
            ASSERT_LE(end - ran.begin() - static_cast<std::ptrdiff_t>(first), 2 * budget) << "seed " << seed;
        }
    }
}

}  // namespace
}  // namespace qduino::sched::deferrable_server_test
