#include "board/linux/loop/timer_gravity.h"

#include <gtest/gtest.h>

#include <functional>
#include <random>

namespace qduino::board::linux::timer_gravity_test {
namespace {

/// A loop with a period of 1 ms that wakes `takes()` after its alarm.
struct Loop {
    TimerGravity gravity;
    Instant due = kEpoch;
    int early = 0;            ///< wake-ups before it was due
    Nanoseconds waited{0};    ///< and what it spun through then
    Nanoseconds lateness{0};  ///< sum, of all

    void run(int releases, const std::function<Nanoseconds()>& takes) {
        for (int i = 0; i < releases; ++i) {
            const Instant now = due + 200us;
            due += 1ms;
            const Instant woke = gravity.alarm_for(due, now) + takes();
            gravity.woke(woke);
            if (woke < due) {
                ++early;
                waited += due - woke;
            } else {
                lateness += woke - due;
            }
        }
    }
};

/// 14 us and more, exponentially; 9 us more on average.
std::function<Nanoseconds()> wake_ups(std::uint32_t seed) {
    return [random = std::mt19937{seed}, more = std::exponential_distribution{1 / 9000.0}]() mutable {
        return 14us + Nanoseconds{static_cast<std::int64_t>(more(random))};
    };
}

TEST(TimerGravity, TakesFromEachWakeUpWhatNearlyAllOfThemTake) {
    Loop loop;
    loop.run(200, wake_ups(1));
    loop.early = 0;
    loop.waited = loop.lateness = Nanoseconds{0};
    loop.run(10'000, wake_ups(2));
    EXPECT_GT(loop.early, 10'000 / 12);
    EXPECT_LT(loop.early, 10'000 / 6);
    EXPECT_LT(loop.waited / 10'000, 200ns);  // what it costs, a release
    EXPECT_LT(loop.lateness / 10'000, 9us);  // 23 us without
    EXPECT_GT(loop.gravity.lead(), 14us);
}

TEST(TimerGravity, BeginsAtTheQuickestOfTheFirst) {
    Loop loop;
    Nanoseconds next = 40us;
    loop.run(TimerGravity::kFirst, [&] { return next -= 1us; });
    EXPECT_EQ(loop.gravity.lead(), 0ns);
    EXPECT_EQ(loop.early, 0);
    loop.run(1, [&] { return next; });
    EXPECT_EQ(loop.gravity.lead(), next);
}

TEST(TimerGravity, FollowsAMachineThatBecomesQuickerAndSlower) {
    Loop loop;
    loop.run(1000, [] { return Nanoseconds{30us}; });
    EXPECT_NEAR(static_cast<double>(loop.gravity.lead().count()), 30'000, 500);
    loop.run(300, [] { return Nanoseconds{4us}; });
    EXPECT_NEAR(static_cast<double>(loop.gravity.lead().count()), 4'000, 500);
    loop.run(1000, [] { return Nanoseconds{30us}; });
    EXPECT_NEAR(static_cast<double>(loop.gravity.lead().count()), 30'000, 500);
}

TEST(TimerGravity, WhatTakesLongerThanAWakeUpTeachesNothing) {
    Loop loop;
    int i = 0;
    // Two of three behind a longer loop with a higher priority.
    loop.run(3000, [&] { return ++i % 3 != 0 ? Nanoseconds{700us} : Nanoseconds{15us}; });
    EXPECT_NEAR(static_cast<double>(loop.gravity.lead().count()), 15'000, 500);
}

/// `median` nearly always; a little less or more, and now and then much more.
std::function<Nanoseconds()> wake_ups_around(Nanoseconds median, std::uint32_t seed) {
    return [median, random = std::mt19937{seed}]() mutable {
        const double scale = std::normal_distribution{1.0, 0.06}(random);
        const bool stalled = random() % 50 == 0;
        return from_seconds(to_seconds(median) * std::max(scale, 0.7)) + (stalled ? 2ms : Nanoseconds{0});
    };
}

TEST(TimerGravity, LearnsOnMachinesOfEverySpeed) {
    for (const Nanoseconds median : {Nanoseconds{20us}, Nanoseconds{69us}, Nanoseconds{200us}}) {
        SCOPED_TRACE(median.count());
        Loop loop;
        loop.run(5000, wake_ups_around(median, 3));  // it climbs by 50 ns a wake-up
        EXPECT_GT(loop.gravity.lead(), median * 80 / 100);
        EXPECT_LT(loop.gravity.lead(), median);
        loop.early = 0;
        loop.waited = Nanoseconds{0};
        loop.run(10'000, wake_ups_around(median, 4));
        EXPECT_GT(loop.early, 10'000 / 14);
        EXPECT_LT(loop.early, 10'000 / 6);
        EXPECT_LT(loop.waited / 10'000, median / 50);
    }
}

TEST(TimerGravity, WhereSomeWakeUpsAreQuickAndMostAreSlowItNeverSpinsForLong) {
    for (const std::uint32_t quick_percent : {50u, 5u}) {
        SCOPED_TRACE(quick_percent);
        Loop loop;
        std::mt19937 random{5};
        const auto mixed = [&] {
            return random() % 100 < quick_percent ? Nanoseconds{20us} : Nanoseconds{200us};
        };
        loop.run(5000, mixed);
        Nanoseconds longest_lead{0};
        for (int i = 0; i < 5000; ++i) {
            loop.run(1, mixed);
            longest_lead = std::max(longest_lead, loop.gravity.lead());
        }
        EXPECT_LE(longest_lead, 60us);  // three of its quickest
        EXPECT_GT(loop.gravity.lead(), 15us);
    }
}

TEST(TimerGravity, FollowsAMachineThatBecomesMuchSlower) {
    Loop loop;
    loop.run(1000, [] { return Nanoseconds{12us}; });
    EXPECT_EQ(loop.gravity.limit(), TimerGravity::kQuick);
    loop.run(9000, [] { return Nanoseconds{200us}; });
    EXPECT_NEAR(static_cast<double>(loop.gravity.lead().count()), 200'000, 500);
    loop.run(1000, [] { return Nanoseconds{12us}; });
    EXPECT_NEAR(static_cast<double>(loop.gravity.lead().count()), 12'000, 500);
}

// A harmonic period: the longer loop is released together with the shorter one, always, and waits
// for it.
TEST(TimerGravity, ALoopThatIsAlwaysReleasedBehindAnotherLearnsNoMoreThanItsWakeUp) {
    Loop loop;
    for (int i = 0; i < 3000; ++i) {
        const Instant before = loop.due + 200us, due = loop.due + 1ms, other_runs = due - 20us;
        loop.due = due;
        const Instant alarm = loop.gravity.alarm_for(due, before);
        // The other one runs from 20 us before this one is due, for 300 us.
        loop.gravity.woke(alarm + 20us < other_runs ? alarm + 20us
                                                    : std::max(alarm + 20us, other_runs + 300us));
        if (i > 500) {
            ASSERT_LE(loop.gravity.lead(), 60us) << i;
        }
    }
}

TEST(TimerGravity, TheLeadIsASmallPartOfTheBudgetThatItIsChargedTo) {
    EXPECT_EQ(TimerGravity::lead_limit(100us, true), TimerGravity::kQuick);
    EXPECT_EQ(TimerGravity::lead_limit(1ms, true), 250us);
    EXPECT_EQ(TimerGravity::lead_limit(30ms, true), TimerGravity::kSlowest);
    EXPECT_EQ(TimerGravity::lead_limit(100us, false), TimerGravity::kSlowest);
    Loop loop{.gravity = TimerGravity{TimerGravity::lead_limit(100us, true)}};
    loop.run(5000, [] { return Nanoseconds{200us}; });
    EXPECT_EQ(loop.gravity.lead(), TimerGravity::kQuick);
    EXPECT_EQ(loop.early, 0);
}

TEST(TimerGravity, AtLeastHalfOfAWaitIsSlept) {
    Loop loop;
    loop.run(1000, [] { return Nanoseconds{20us}; });
    const Instant now = loop.due;
    EXPECT_EQ(loop.gravity.alarm_for(now + 10us, now), now + 5us);
    EXPECT_EQ(loop.gravity.alarm_for(now + 100us, now), now + 100us - loop.gravity.lead());
}

}  // namespace
}  // namespace qduino::board::linux::timer_gravity_test
