#include "board/linux/timer_gravity.h"

#include <gtest/gtest.h>

#include <functional>
#include <random>

namespace qduino::board::linux {
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

TEST(TimerGravity, AtLeastHalfOfAWaitIsSlept) {
    Loop loop;
    loop.run(1000, [] { return Nanoseconds{20us}; });
    const Instant now = loop.due;
    EXPECT_EQ(loop.gravity.alarm_for(now + 10us, now), now + 5us);
    EXPECT_EQ(loop.gravity.alarm_for(now + 100us, now), now + 100us - loop.gravity.lead());
}

}  // namespace
}  // namespace qduino::board::linux
