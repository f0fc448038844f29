#include "sched/core_scheduler.h"

#include <gtest/gtest.h>

#include "tests/unit/sched/make.h"

namespace qduino::sched::core_scheduler_test {
namespace {

constexpr Decision run(VcpuId id, std::int64_t until_ns) { return {id, instant_from_ns(until_ns)}; }
constexpr Decision idle(Instant until) { return {std::nullopt, until}; }

TEST(CoreScheduler, NobodyRunsWithoutWork) {
    CoreScheduler core;
    ASSERT_TRUE(core.add(1, {2ns, 10ns}));
    EXPECT_EQ(core.decide(at_ns(0)), idle(kForever));
    EXPECT_FALSE(core.running());
}

TEST(CoreScheduler, TheShorterPeriodPreempts) {
    CoreScheduler core;
    ASSERT_TRUE(core.add(1, {5ns, 20ns}));
    ASSERT_TRUE(core.add(2, {2ns, 10ns}));
    core.wake(1, at_ns(0));
    EXPECT_EQ(core.decide(at_ns(0)), run(1, 5));
    core.wake(2, at_ns(3));
    EXPECT_EQ(core.consumed(1), 3ns);
    EXPECT_EQ(core.decide(at_ns(3)), run(2, 5));
    EXPECT_EQ(core.decide(at_ns(5)), run(1, 7));
    EXPECT_EQ(core.decide(at_ns(7)), idle(at_ns(13)));
    EXPECT_EQ(core.next_replenishment(2), at_ns(13));
    EXPECT_EQ(core.next_replenishment(1), at_ns(20));
}

TEST(CoreScheduler, ALateWakeUpDoesNotDelayTheBudgetsOfLaterReleases) {
    CoreScheduler core;
    ASSERT_TRUE(core.add(1, {8ns, 10ns}));
    // An interrupt held the core from 0 to 2. The release was due at 0.
    core.wake(1, at_ns(2), at_ns(0));
    EXPECT_EQ(core.decide(at_ns(2)), run(1, 10));
    core.block(1, at_ns(10));
    core.wake(1, at_ns(10), at_ns(10));
    EXPECT_EQ(core.decide(at_ns(10)), run(1, 18)) << "and not 12: its budget is back";
}

TEST(CoreScheduler, AReleaseThatEndedLateWasNotDueBeforeItsEnd) {
    CoreScheduler core;
    ASSERT_TRUE(core.add(1, {3ns, 10ns}));
    core.wake(1, at_ns(0));
    EXPECT_EQ(core.decide(at_ns(11)), run(1, 14));
    core.block(1, at_ns(14));
    core.wake(1, at_ns(15), at_ns(10));
    EXPECT_EQ(core.decide(at_ns(15)).vcpu, VcpuId{1});
    core.block(1, at_ns(17));
    EXPECT_EQ(core.server(1).refills().back(), (Refill{at_ns(24), 2ns}));
}

TEST(CoreScheduler, AReplenishmentOfHigherPriorityEndsTheDecision) {
    CoreScheduler core;
    ASSERT_TRUE(core.add(1, {2ns, 10ns}));
    ASSERT_TRUE(core.add(2, {50ns, 100ns}));
    core.wake(1, at_ns(0));
    core.wake(2, at_ns(0));
    EXPECT_EQ(core.decide(at_ns(0)), run(1, 2));
    EXPECT_EQ(core.decide(at_ns(2)), run(2, 10));
    EXPECT_EQ(core.decide(at_ns(10)), run(1, 12));
}

TEST(CoreScheduler, AReplenishmentOfLowerPriorityDoesNot) {
    CoreScheduler core;
    ASSERT_TRUE(core.add(1, {40ns, 50ns}));
    ASSERT_TRUE(core.add(2, {2ns, 60ns}));
    core.wake(2, at_ns(0));
    EXPECT_EQ(core.decide(at_ns(0)), run(2, 2));
    EXPECT_EQ(core.decide(at_ns(2)), idle(at_ns(60)));
    core.wake(1, at_ns(30));
    // Not at 60, when 2 has budget again: it cannot run then.
    EXPECT_EQ(core.decide(at_ns(30)), run(1, 70));
}

TEST(CoreScheduler, EqualPeriodsGoByTheLowerId) {
    CoreScheduler core;
    ASSERT_TRUE(core.add(7, {2ns, 10ns}));
    ASSERT_TRUE(core.add(3, {2ns, 10ns}));
    core.wake(7, at_ns(0));
    core.wake(3, at_ns(0));
    EXPECT_EQ(core.decide(at_ns(0)), run(3, 2));
    EXPECT_EQ(core.decide(at_ns(2)), run(7, 4));
}

TEST(CoreScheduler, BlockingLeavesTheCore) {
    CoreScheduler core;
    ASSERT_TRUE(core.add(1, {5ns, 20ns}));
    core.wake(1, at_ns(0));
    EXPECT_EQ(core.decide(at_ns(0)), run(1, 5));
    core.block(1, at_ns(2));
    EXPECT_FALSE(core.running());
    EXPECT_EQ(core.decide(at_ns(2)), idle(kForever));
    EXPECT_EQ(core.consumed(1), 2ns);
    EXPECT_EQ(core.available(1, at_ns(2)), 3ns);
}

TEST(CoreScheduler, AnOwningVcpuIsNeverThrottled) {
    CoreScheduler core;
    ASSERT_TRUE(core.add(1, {10ns, 10ns}, kEpoch, {.owns_core = true}));
    core.wake(1, at_ns(0));
    EXPECT_EQ(core.decide(at_ns(0)), (Decision{VcpuId{1}, kForever}));
    EXPECT_EQ(core.decide(at_ns(1'000'000)), (Decision{VcpuId{1}, kForever}));
    EXPECT_EQ(core.consumed(1), 1'000'000ns);
}

TEST(CoreScheduler, AnIoVcpuHasThePriorityOfItsClient) {
    CoreScheduler core;
    ASSERT_TRUE(core.add(1, {20ns, 100ns}));
    ASSERT_TRUE(core.add(2, {200ns, 1000ns}));
    ASSERT_TRUE(core.add_io(33, {1ns, 10ns}));
    core.wake(1, at_ns(0));
    core.wake_io(33, at_ns(0), 1000ns);
    EXPECT_EQ(core.decide(at_ns(0)), run(1, 20));
    EXPECT_EQ(core.decide(at_ns(20)), run(33, 100));  // U·T = 100, until loop 1 comes back
    core.wake_io(33, at_ns(30), 100ns);               // raised above, clamped to U·100
    EXPECT_EQ(core.available(33, at_ns(30)), 10ns);
    EXPECT_EQ(core.decide(at_ns(30)), run(33, 40));
    core.block(33, at_ns(35));
    EXPECT_EQ(core.decide(at_ns(35)), idle(at_ns(100)));
    EXPECT_EQ(core.consumed(33), 15ns);
}

TEST(CoreScheduler, AnIoVcpuMayServeAnotherCoresLoop) {
    CoreScheduler core;
    ASSERT_TRUE(core.add(1, {20ns, 100ns}));
    ASSERT_TRUE(core.add_io(33, {1ns, 10ns}));
    core.wake(1, at_ns(0));
    core.wake_io(33, at_ns(0), 50ns);
    EXPECT_EQ(core.decide(at_ns(0)), run(33, 5));
    EXPECT_EQ(core.decide(at_ns(5)), run(1, 25));
}

TEST(CoreScheduler, StolenTimeIsNotCharged) {
    CoreScheduler core;
    ASSERT_TRUE(core.add(1, {10ns, 100ns}));
    core.wake(1, at_ns(0));
    EXPECT_EQ(core.decide(at_ns(0)), run(1, 10));
    core.account(at_ns(8), 5ns);
    EXPECT_EQ(core.consumed(1), 3ns);
    EXPECT_EQ(core.decide(at_ns(8)), run(1, 15));
}

TEST(CoreScheduler, RefusesWhatItCannotHold) {
    CoreScheduler core;
    EXPECT_FALSE(core.add(1, {0ns, 10ns}));
    EXPECT_FALSE(core.add(1, {9ns, 10ns}, kEpoch, {.owns_core = true}));
    EXPECT_FALSE(core.contains(1));
    for (int i = 1; i <= 32; ++i) EXPECT_TRUE(core.add(static_cast<VcpuId>(i), {1ns, 1us}));
    EXPECT_FALSE(core.add(200, {1ns, 1us}));
    for (int i = 33; i <= 63; ++i) EXPECT_TRUE(core.add_io(static_cast<VcpuId>(i), {1ns, 1us}));
    EXPECT_FALSE(core.add_io(201, {1ns, 1us}));
    EXPECT_FALSE(core.add_io(33, {1ns, 1us}));
    EXPECT_FALSE(core.server(1).is_io());
    EXPECT_TRUE(core.server(33).is_io());
    EXPECT_FALSE(core.contains(200));
}

TEST(CoreSchedulerDeathTest, ContractsHold) {
    CoreScheduler core;
    ASSERT_TRUE(core.add(1, {5ns, 10ns}));
    ASSERT_TRUE(core.add_io(33, {5ns, 10ns}));
    core.wake(1, at_ns(5));
    static_cast<void>(core.decide(at_ns(5)));
    EXPECT_DEATH(core.wake(2, at_ns(6)), "contract broken");
    EXPECT_DEATH(core.wake_io(1, at_ns(6), 10ns), "contract broken");
    EXPECT_DEATH(static_cast<void>(core.decide(at_ns(4))), "contract broken");
    EXPECT_DEATH(core.account(at_ns(6), 2ns), "contract broken");
}

// ---- locks --------------------------------------------------------------------------------------

TEST(CoreScheduler, AnInheritedRankGoesBeforeThoseBetween) {
    CoreScheduler core;
    ASSERT_TRUE(core.add(1, {5ns, 100ns}));
    ASSERT_TRUE(core.add(2, {5ns, 50ns}));
    core.wake(1, at_ns(0));
    core.wake(2, at_ns(0));
    EXPECT_EQ(core.decide(at_ns(0)), run(2, 5));
    core.inherit(1, {10ns, 3});  // a VCPU of period 10, perhaps of another core, waits for 1
    EXPECT_EQ(core.decide(at_ns(1)), run(1, 6));
    core.inherit(1, Rank{});  // no more
    EXPECT_EQ(core.decide(at_ns(2)), run(2, 6));
    core.inherit(1, {200ns, 9});  // below its own: it keeps its own
    core.block(2, at_ns(3));
    EXPECT_EQ(core.decide(at_ns(3)), run(1, 7));
}

TEST(CoreScheduler, AHolderWithoutBudgetRunsOnItsWaitersAndAtItsRank) {
    CoreScheduler core;
    ASSERT_TRUE(core.add(1, {3ns, 10ns}));   // holds the lock
    ASSERT_TRUE(core.add(2, {5ns, 20ns}));   // has no part in it
    ASSERT_TRUE(core.add(3, {4ns, 100ns}));  // waits for it
    core.wake(3, at_ns(0));
    core.wait_for_lock(3, true, at_ns(0));
    core.inherit(1, {100ns, 3});
    core.wake(1, at_ns(0));
    EXPECT_EQ(core.decide(at_ns(0)), run(1, 3));
    core.wake(2, at_ns(3));
    EXPECT_EQ(core.decide(at_ns(3)), run(2, 8));  // above 3, and so above 1
    core.block(2, at_ns(8));
    EXPECT_EQ(core.decide(at_ns(8)), run(1, 10));
    EXPECT_EQ(core.decide(at_ns(10)), run(1, 13));  // its own again
    EXPECT_EQ(core.consumed(3), 2ns);
    core.inherit(1, Rank{});  // it gave the lock back
    core.wait_for_lock(3, false, at_ns(11));
    EXPECT_EQ(core.decide(at_ns(11)), run(1, 13));
    EXPECT_EQ(core.decide(at_ns(13)), run(3, 15));
    EXPECT_EQ(core.consumed(1), 6ns);
}

TEST(CoreScheduler, AHolderWithoutBudgetForWhomNobodyWaitsIsThrottled) {
    CoreScheduler core;
    ASSERT_TRUE(core.add(1, {3ns, 10ns}));
    core.wake(1, at_ns(0));
    EXPECT_EQ(core.decide(at_ns(0)), run(1, 3));
    EXPECT_EQ(core.decide(at_ns(3)), idle(at_ns(10)));
}

TEST(CoreScheduler, AHolderWithoutBudgetOverrunsForAWaiterOfAnotherCoreByOneBudgetAtMost) {
    CoreScheduler core;
    ASSERT_TRUE(core.add(1, {3ns, 10ns}));
    core.wake(1, at_ns(0));
    EXPECT_EQ(core.decide(at_ns(0)), run(1, 3));
    core.inherit(1, {20ns, 9});
    EXPECT_EQ(core.decide(at_ns(3)), run(1, 6));
    EXPECT_EQ(core.decide(at_ns(5)), run(1, 6));
    EXPECT_EQ(core.decide(at_ns(6)), idle(at_ns(20))) << "it pays: the refill at 10 is spent";
    core.inherit(1, Rank{});
    EXPECT_EQ(core.decide(at_ns(20)), run(1, 23));
}

/// A handler says that it holds locks for 2 ns: so long nobody else pays. From then on its waiter
/// does.
TEST(CoreScheduler, AHandlerWithoutBudgetPaysForItsSectionsItself) {
    CoreScheduler core;
    ASSERT_TRUE(core.add_io(33, {1ns, 10ns}, kEpoch, {.client_period = 10ns, .overrun = 2ns}));
    ASSERT_TRUE(core.add(2, {4ns, 20ns}));
    core.wake(33, at_ns(0));
    EXPECT_EQ(core.decide(at_ns(0)), run(33, 1));
    core.wake(2, at_ns(1));
    core.wait_for_lock(2, true, at_ns(1));
    core.inherit(33, {20ns, 2});
    EXPECT_EQ(core.decide(at_ns(1)), run(33, 3));
    EXPECT_EQ(core.decide(at_ns(3)).vcpu, std::optional<VcpuId>{33});
    EXPECT_EQ(core.consumed(33), 3ns);
    EXPECT_EQ(core.consumed(2), 0ns);
    core.inherit(33, Rank{});
    core.wait_for_lock(2, false, at_ns(4));
    EXPECT_EQ(core.decide(at_ns(4)).vcpu, std::optional<VcpuId>{2});
    EXPECT_EQ(core.consumed(33), 3ns);
    EXPECT_EQ(core.consumed(2), 1ns);
    EXPECT_GE(core.next_replenishment(33), at_ns(30)) << "it used 3 ns of 1 in 10";
}

/// A board without an operating system charges what a late alarm let run, in one piece.
TEST(CoreScheduler, AnAlarmThatComesBehindAReplenishmentGivesNoService) {
    CoreScheduler core;
    ASSERT_TRUE(core.add(1, {5ns, 20ns}));
    ASSERT_TRUE(
        core.add_io(33, {1ns, 4ns}, kEpoch, {.activation = {}, .client_period = {}, .overrun = 10ns}));
    core.wake_io(33, at_ns(0), 16ns);
    EXPECT_EQ(core.decide(at_ns(0)), run(33, 4));
    EXPECT_EQ(core.decide(at_ns(4)), idle(at_ns(16))) << "with a lock";
    core.wake(1, at_ns(15));
    core.wait_for_lock(1, true, at_ns(15));
    core.inherit(33, {20ns, 1});
    EXPECT_EQ(core.decide(at_ns(15)).vcpu, VcpuId{33}) << "it goes on for its waiter";
    core.account(at_ns(18));
    core.inherit(33, {});
    core.wait_for_lock(1, false, at_ns(18));
    EXPECT_EQ(core.decide(at_ns(18)).vcpu, VcpuId{1});
    EXPECT_EQ(core.next_replenishment(33), at_ns(28)) << "one before its replenishment, two behind it";
    EXPECT_EQ(core.available(33, at_ns(18)), 0ns);
}

TEST(CoreScheduler, ACostIsChargedOutOfTheBudgetsToCome) {
    CoreScheduler core;
    ASSERT_TRUE(core.add(1, {3ns, 10ns}));
    core.wake(1, at_ns(0));
    core.charge(1, 4ns, at_ns(0));
    EXPECT_EQ(core.consumed(1), 4ns);
    EXPECT_EQ(core.decide(at_ns(0)), idle(at_ns(11)));
}

TEST(CoreScheduler, AWaitForALockDelaysNoRefill) {
    CoreScheduler core;
    ASSERT_TRUE(core.add(1, {3ns, 10ns}));
    core.wake(1, at_ns(0));
    core.wait_for_lock(1, true, at_ns(0));
    EXPECT_FALSE(core.decide(at_ns(0)).vcpu);
    core.wait_for_lock(1, false, at_ns(6));
    EXPECT_EQ(core.decide(at_ns(6)), run(1, 9));
    EXPECT_EQ(core.decide(at_ns(9)), idle(at_ns(10)));  // and not at 16
}

TEST(CoreScheduler, ADeferrableLoopsBudgetComesBackAtOnce) {
    CoreScheduler core;
    ASSERT_TRUE(core.add(1, {3ns, 10ns}, kEpoch, {.deferrable = true}));
    core.wake(1, at_ns(0));
    core.block(1, at_ns(0));
    core.wake(1, at_ns(7));
    EXPECT_EQ(core.decide(at_ns(7)), run(1, 13));
    EXPECT_EQ(core.decide(at_ns(13)), idle(at_ns(20)));
}

}  // namespace
}  // namespace qduino::sched::core_scheduler_test
