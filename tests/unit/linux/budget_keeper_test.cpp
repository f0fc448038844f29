// The keeper of a thread's budget and the locks that the thread holds. Counted on the thread's CPU clock: how long it all took does
// not matter.
#include "board/linux/budget_keeper.h"

#include <gtest/gtest.h>

#include <functional>
#include <thread>

#include "board/linux/clock.h"

namespace qduino::board::linux::test {
namespace {

constexpr Nanoseconds kBudget = 2ms;
constexpr Nanoseconds kPeriod = 500ms;  // long: on a busy machine what is consumed here may take a while

/// Runs `body` on a thread that `keeper` keeps to that.
void keep(const std::function<void(BudgetKeeper& keeper)>& body) {
    std::thread{[&] {
        BudgetKeeper keeper;
        VcpuSpec spec;
        spec.budget = kBudget;
        spec.period = kPeriod;
        ASSERT_TRUE(keeper.start(spec).ok());
        body(keeper);
        keeper.stop();
    }}.join();
}

void consume(Nanoseconds amount) {
    const Nanoseconds until = thread_cpu_time() + amount;
    while (thread_cpu_time() < until) {
    }
}

TEST(BudgetKeeper, PutsAThreadToSleepAtTheEndOfItsBudget) {
    keep([](BudgetKeeper& keeper) {
        consume(3ms);
        EXPECT_GE(keeper.throttled(), 1u);
    });
}

TEST(BudgetKeeper, WaitsForTheLastUnlockAndChargesWhatWasOverrun) {
    keep([](BudgetKeeper& keeper) {
        keeper.begin_hold();
        consume(1ms);
        keeper.begin_hold();
        consume(2ms);
        keeper.end_hold();
        EXPECT_EQ(keeper.throttled(), 0u);
        keeper.end_hold();
        EXPECT_GE(keeper.throttled(), 1u);
        EXPECT_GE(keeper.charged(), Nanoseconds{3ms});
    });
}

TEST(BudgetKeeper, DoesNotWaitForAnUnlockThatDoesNotCome) {
    keep([](BudgetKeeper& keeper) {
        keeper.begin_hold();
        consume(2 * kBudget + 1ms);
        EXPECT_GE(keeper.throttled(), 1u);
        keeper.end_hold();
    });
}

TEST(BudgetKeeper, ALockWithinTheBudgetChangesNothing) {
    keep([](BudgetKeeper& keeper) {
        keeper.begin_hold();
        consume(500us);
        keeper.end_hold();
        EXPECT_EQ(keeper.throttled(), 0u);
        consume(2ms);
        EXPECT_GE(keeper.throttled(), 1u);
    });
}

}  // namespace
}  // namespace qduino::board::linux::test
