// The account of a budget, event by event, and the drawing at its head: a budget of 10 in 100.
#include "sched/budget_account.h"

#include <gtest/gtest.h>

#include "tests/unit/sched/make.h"

namespace qduino::sched::budget_account_test {
namespace {

using Phase = BudgetAccount::Phase;
using Kind = BudgetEffect::Kind;

constexpr BudgetEffect arm_in(Nanoseconds in) { return {.kind = Kind::arm_in, .in = in}; }
constexpr BudgetEffect step_back_for(Nanoseconds in) {
    return {.kind = Kind::arm_in, .in = in, .steps_back = true};
}
constexpr BudgetEffect arm_at(std::int64_t at) { return {.kind = Kind::arm_at, .at = at_ns(at)}; }
constexpr BudgetEffect sleep_until(std::int64_t at) { return {.kind = Kind::sleep_until, .at = at_ns(at)}; }
constexpr BudgetEffect kDisarm{.kind = Kind::disarm};
constexpr BudgetEffect kNothing{};

/// The clocks at `now`, with `cpu` used so far and so many waits behind it.
constexpr BudgetReading at(std::int64_t now, std::int64_t cpu, std::int64_t switches = 0) {
    return {at_ns(now), Nanoseconds{cpu}, switches};
}

BudgetAccount make_account() { return {SporadicServer{{10ns, 100ns}}, at(0, 0)}; }

TEST(BudgetAccount, SetsTheTimerToWhatIsLeftAndToTheRestWhenItComesEarly) {
    BudgetAccount account = make_account();
    EXPECT_EQ(account.timer(at(0, 0)), arm_in(10ns));
    EXPECT_EQ(account.timer(at(10, 4)), arm_in(6ns));  // it was preempted for 6
    EXPECT_EQ(account.phase(), Phase::running);
    EXPECT_EQ(account.server().consumed(), 4ns);
}

TEST(BudgetAccount, SleepsWhenTheBudgetIsSpentUntilItComesBack) {
    BudgetAccount account = make_account();
    EXPECT_EQ(account.timer(at(10, 10)), sleep_until(100));
    EXPECT_EQ(account.phase(), Phase::throttled);
    EXPECT_EQ(account.resumed(at(101, 11, 1)), arm_in(10ns));
    EXPECT_EQ(account.phase(), Phase::running);
    EXPECT_EQ(account.server().consumed(), 10ns);
}

TEST(BudgetAccount, TheWayThroughASleepForASpentBudgetIsOneOfThem) {
    BudgetAccount account = make_account();
    static_cast<void>(account.blocks(at(0, 0), kForever));
    EXPECT_EQ(account.woke(at_ns(1), 0ns), arm_in(10ns));
    EXPECT_EQ(account.timer(at(11, 10, 1)), sleep_until(101));
    EXPECT_EQ(account.resumed(at(102, 12, 2)), arm_in(10ns)) << "the wait's was in the period before";
    for (const std::int64_t cpu : {12, 15}) {
        static_cast<void>(account.blocks(at(10 * cpu - 10, cpu, cpu / 3 - 2), kForever));
        static_cast<void>(account.woke(at_ns(10 * cpu), Nanoseconds{cpu + 3}));
    }
    EXPECT_EQ(account.timer(at(150, 18, 4)), arm_in(7ns)) << "one was this period's, one the next's";
}

TEST(BudgetAccount, OfALongWayThroughSuchASleepAThousandthOfThePeriodIsLeftOut) {
    BudgetAccount account{SporadicServer{{1ms, 50ms}}, at(0, 0)};
    EXPECT_EQ(account.timer(at(1'000'000, 1'000'000)), sleep_until(50'000'000));
    EXPECT_EQ(account.resumed(at(50'200'000, 1'200'000, 1)), arm_in(850us));
}

/// A busy thread whose timer's interrupt costs `late`, and each way through a sleep `way`: how much
/// of its own it gets done in twenty periods.
Nanoseconds done_in_twenty_periods(std::int64_t late, std::int64_t way) {
    BudgetAccount account{DeferrableServer{{100ns, 1000ns}, {}, 50ns}, at(0, 0), 20ns};
    std::int64_t now = 0, cpu = 0, done = 0;
    for (BudgetEffect effect = account.timer(at(0, 0)); now < 20'000;) {
        const bool sleep = effect.kind == Kind::sleep_until;
        done += sleep ? 0 : std::max<std::int64_t>(effect.in.count() - late, 0);
        const std::int64_t used = sleep ? way : effect.in.count() + late;
        now = sleep ? std::max(now, to_ns(effect.at)) + way : now + used;
        cpu += used;
        effect = sleep ? account.resumed(at(now, cpu)) : account.timer(at(now, cpu));
    }
    return Nanoseconds{done};
}

TEST(BudgetAccount, ALoopGetsOnThoughToKeepItCostsMoreThanItsBudget) {
    EXPECT_GT(done_in_twenty_periods(0, 150), 1900ns) << "a sleep for a spent budget costs more";
    EXPECT_GT(done_in_twenty_periods(60, 150), 350ns) << "what the timer's interrupt leaves is less";
}

/// How often a thread sleeps for its budget in ten periods. It waits so often that admission has no
/// way left for those sleeps. The way into one costs 4 of CPU time and the way out of it 5; a sleep
/// to an instant that has passed, or nearly so, is nothing but these two.
int sleeps_in_ten_periods(Nanoseconds rest) {
    constexpr std::int64_t kWayIn = 4, kWayOut = 5, kBetweenWaits = 10;
    BudgetAccount account{SporadicServer{{100ns, 1000ns}}, at(0, 0), rest};
    std::int64_t now = 0, cpu = 0, switches = 0;
    int sleeps = 0;
    const auto run = [&](std::int64_t time) { return at(now += time, cpu += time, switches); };
    for (BudgetEffect effect = account.timer(at(0, 0)); now < 10'000;) {
        if (effect.kind == Kind::sleep_until) {
            ++sleeps;
            run(kWayIn);
            now = std::max(now, to_ns(effect.at));
            effect = account.resumed(run(kWayOut));
        } else if (effect.in.count() <= kBetweenWaits) {
            effect = account.timer(run(effect.in.count()));
        } else {
            static_cast<void>(account.blocks(run(kBetweenWaits), kForever));
            ++switches;
            effect = account.woke(at_ns(++now), Nanoseconds{cpu});
        }
    }
    return sleeps;
}

TEST(BudgetAccount, AThrottledThreadThatSleepsALittleLongerSleepsLessOften) {
    EXPECT_GT(sleeps_in_ten_periods(0ns), 2 * sleeps_in_ten_periods(5ns))
        << "it pays for sleeps with its budget";
}

TEST(BudgetAccount, SetsTheTimerAheadOfAWaitWhoseEndIsKnown) {
    BudgetAccount account = make_account();
    EXPECT_EQ(account.blocks(at(3, 3), at_ns(50)), arm_at(57));
    EXPECT_EQ(account.phase(), Phase::armed_ahead);
    EXPECT_EQ(account.woke(at_ns(52), 3ns), kNothing);
    EXPECT_EQ(account.phase(), Phase::woken);
    EXPECT_EQ(account.timer(at(57, 8, 1)), arm_in(2ns));  // 2 too early, because it woke 2 late
    EXPECT_EQ(account.timer(at(59, 10, 1)), sleep_until(100));
}

TEST(BudgetAccount, AnAlarmThatComesALittleBeforeThePeriodLeavesTheTimerAfterTheNextBudget) {
    BudgetAccount account{DeferrableServer{{10ns, 100ns}}, at(0, 0)};
    EXPECT_EQ(account.blocks(at(3, 3), at_ns(98)), arm_at(110));
    EXPECT_EQ(account.woke(at_ns(99), 3ns), kNothing);
    account.release(at_ns(100));
    EXPECT_EQ(account.timer(at(110, 14, 1)), sleep_until(200));
}

TEST(BudgetAccount, SetsNoTimerAheadOfAWaitThatMayEndAtAnyTime) {
    BudgetAccount account = make_account();
    EXPECT_EQ(account.blocks(at(3, 3), kForever), kDisarm);
    EXPECT_EQ(account.phase(), Phase::waiting);
    EXPECT_EQ(account.woke(at_ns(52), 3ns), arm_in(7ns));
    EXPECT_EQ(account.phase(), Phase::running);
}

TEST(BudgetAccount, SetsNoTimerAheadOfAWaitBehindWhichThereIsNoBudget) {
    BudgetAccount account = make_account();
    EXPECT_EQ(account.blocks(at(10, 10), at_ns(50)), kDisarm);
    EXPECT_EQ(account.woke(at_ns(50), 10ns), sleep_until(100));
}

TEST(BudgetAccount, TheWaysThroughTwoWaitsAreAdmissionsAndTheThirdIsCharged) {
    BudgetAccount account = make_account();
    for (const std::int64_t now : {10, 20, 30}) {
        static_cast<void>(account.blocks(at(now, now / 5 - 2, now / 10 - 1), kForever));
        static_cast<void>(account.woke(at_ns(now + 5), Nanoseconds{now / 5}));
    }
    // The ways took 6: admission has one in each period, and the one before.
    EXPECT_EQ(account.server().consumed(), 2ns);
    EXPECT_EQ(account.server().available(at_ns(35)), 8ns) << "what is left is left at once";
}

TEST(BudgetAccount, CountsAWaitThatNobodyAnnouncedFromTheLatestInstantAtWhichItCanHaveEnded) {
    BudgetAccount account = make_account();
    EXPECT_EQ(account.timer(at(50, 4, 1)), arm_in(6ns));
    EXPECT_EQ(account.server().next_replenishment(), at_ns(50));
    EXPECT_EQ(account.server().refills().back().time, at_ns(146)) << "used from 46 on, at the latest";
}

TEST(BudgetAccount, ChargesNeverMoreThanTheTimeThatPassedAndTheRestLater) {
    BudgetAccount account = make_account();
    EXPECT_EQ(account.timer(at(5, 6)), arm_in(5ns));
    EXPECT_EQ(account.timer(at(4, 6)), arm_in(5ns)) << "a clock that runs back stands still";
    EXPECT_EQ(account.timer(at(8, 8)), arm_in(2ns));
    EXPECT_EQ(account.server().consumed(), 8ns);
}

// ---- locks --------------------------------------------------------------------------------------

TEST(BudgetAccount, PutsTheSleepOffUntilTheLastUnlock) {
    BudgetAccount account = make_account();
    account.holds();
    account.holds();
    EXPECT_EQ(account.timer(at(10, 10)), step_back_for(10ns));
    EXPECT_EQ(account.phase(), Phase::overrunning);
    EXPECT_FALSE(account.releases());
    EXPECT_TRUE(account.releases());
    EXPECT_EQ(account.timer(at(14, 14)), sleep_until(104)) << "4 of the next budget are gone";
}

TEST(BudgetAccount, PutsItOffByOneBudgetAtMost) {
    BudgetAccount account = make_account();
    account.holds();
    EXPECT_EQ(account.timer(at(10, 10)), step_back_for(10ns));
    EXPECT_EQ(account.timer(at(20, 16)), step_back_for(4ns)) << "it was preempted for 4";
    EXPECT_EQ(account.blocks(at(21, 17), kForever), kDisarm);
    EXPECT_EQ(account.woke(at_ns(30), 17ns), step_back_for(3ns)) << "a wait renews nothing";
    EXPECT_EQ(account.timer(at(33, 20, 1)).kind, Kind::sleep_until);
    EXPECT_FALSE(account.releases());
}

TEST(BudgetAccount, OrByAsMuchAsItsSectionsSay) {
    BudgetAccount account = make_account();
    account.may_overrun(25ns);
    account.holds();
    EXPECT_EQ(account.timer(at(10, 10)), step_back_for(25ns));
}

TEST(BudgetAccount, ALockWithinTheBudgetChangesNothing) {
    BudgetAccount account = make_account();
    account.holds();
    EXPECT_FALSE(account.releases());
    EXPECT_EQ(account.timer(at(10, 10)), sleep_until(100));
}

TEST(BudgetAccount, EachHoldHasABudgetOfItsOwn) {
    BudgetAccount account = make_account();
    account.holds();
    EXPECT_EQ(account.timer(at(16, 16)), step_back_for(4ns));
    ASSERT_TRUE(account.releases());
    EXPECT_EQ(account.timer(at(16, 16)), sleep_until(106));
    EXPECT_EQ(account.resumed(at(106, 16, 1)), arm_in(4ns));
    account.holds();
    EXPECT_EQ(account.timer(at(110, 20, 1)), step_back_for(10ns));
}

TEST(BudgetAccount, WhatTheWayThroughAWaitOverranIsNotTheLocks) {
    BudgetAccount account = make_account();
    for (const std::int64_t now : {0, 1}) {  // the two waits that admission has
        static_cast<void>(account.blocks(at(now, 0, now), kForever));
        static_cast<void>(account.woke(at_ns(now + 1), 0ns));
    }
    EXPECT_EQ(account.blocks(at(11, 9, 2), at_ns(20)), arm_at(21));
    EXPECT_EQ(account.woke(at_ns(20), 12ns), kNothing);  // the way took 3, and 1 was left
    account.holds();
    EXPECT_EQ(account.timer(at(21, 13, 3)), step_back_for(9ns));
}

// ---- I/O VCPUs ----------------------------------------------------------------------------------

TEST(BudgetAccount, AnIoVcpuIsKeptByItsOwnServer) {
    BudgetAccount account{Pibs{{10ns, 100ns}}, at(0, 0)};
    EXPECT_EQ(account.blocks(at(5, 5), at_ns(60)), arm_at(70)) << "used 5: a whole budget from 50 on";
    EXPECT_EQ(account.woke(at_ns(60), 5ns), kNothing);
    EXPECT_EQ(account.timer(at(70, 15, 1)), sleep_until(160));
    EXPECT_EQ(account.server().consumed(), 15ns);
}

TEST(BudgetAccount, AnIoVcpusChangeIsChargedUpToItAndSetsTheTimerAnew) {
    BudgetAccount account{Pibs{{10ns, 100ns}}, at(0, 0)};
    EXPECT_EQ(account.change(at(5, 5), {20ns, 100ns}), sleep_until(50)) << "5 at a tenth";
    EXPECT_EQ(account.resumed(at(50, 5)), arm_in(20ns));
    EXPECT_EQ(account.server().consumed(), 5ns);
}

TEST(BudgetAccountDeathTest, ContractsHold) {
    BudgetAccount account = make_account();
    EXPECT_DEATH(static_cast<void>(account.releases()), "contract broken");
    EXPECT_DEATH(static_cast<void>(account.woke(at_ns(1), 0ns)), "contract broken");
    EXPECT_DEATH(static_cast<void>(account.resumed(at(1, 0))), "contract broken");
    static_cast<void>(account.blocks(at(1, 1), kForever));
    EXPECT_DEATH(static_cast<void>(account.timer(at(2, 1))), "contract broken");
    EXPECT_DEATH(static_cast<void>(account.blocks(at(2, 1), kForever)), "contract broken");
}

}  // namespace
}  // namespace qduino::sched::budget_account_test
