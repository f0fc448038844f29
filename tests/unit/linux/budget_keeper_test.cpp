// The keeper of a thread's budget and the locks that the thread holds. Counted on the thread's CPU
// clock: how long it all took does not matter.
#include "board/linux/loop/budget_keeper.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <thread>
#include <vector>

#include "board/linux/kernel/clock.h"

namespace qduino::board::linux::test::budget_keeper_test {
namespace {

constexpr Nanoseconds kBudget = 2ms;
// Long: on a busy machine what is consumed here may take a while.
constexpr Nanoseconds kPeriod = 500ms;

/// Runs `body` on a thread that `keeper` keeps to that.
void keep(const std::function<void(BudgetKeeper& keeper)>& body, Nanoseconds budget = kBudget,
          Nanoseconds period = kPeriod) {
    std::thread{[&] {
        BudgetKeeper keeper;
        VcpuSpec spec;
        spec.budget = budget;
        spec.period = period;
        ASSERT_TRUE(keeper.start(spec, 0).ok());
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

/// As much as it can, on an I/O VCPU of 2 ms in 500, that is changed after `before_change`.
void keep_changed(sched::VcpuParameters to, Nanoseconds before_change,
                  const std::function<void(const BudgetKeeper&)>& look) {
    std::thread{[&] {
        BudgetKeeper keeper;
        VcpuSpec spec;
        spec.kind = VcpuKind::io;
        spec.budget = kBudget;
        spec.period = kPeriod;
        ASSERT_TRUE(keeper.start(spec, 0).ok());
        consume(before_change);
        keeper.change(to);
        keeper.before_block(monotonic_now() + 1us);
        keeper.after_block(monotonic_now());
        look(keeper);
        keeper.stop();
    }}.join();
}

TEST(BudgetKeeper, AnIoVcpusThreadHasTheBudgetThatItIsChangedTo) {
    keep_changed({100ms, 500ms}, 100us, [](const BudgetKeeper& keeper) {
        const std::uint64_t before = keeper.throttled();
        consume(20ms);
        EXPECT_EQ(keeper.throttled(), before) << "ten times what it had";
        EXPECT_EQ(keeper.changed(), (sched::VcpuParameters{100ms, 500ms}));
    });
}

TEST(BudgetKeeper, AChangeIsTakenUpWhenTheBudgetEnds) {
    std::thread{[&] {
        BudgetKeeper keeper;
        VcpuSpec spec;
        spec.kind = VcpuKind::io;
        spec.budget = kBudget;
        spec.period = 20ms;
        ASSERT_TRUE(keeper.start(spec, 0).ok());
        keeper.change({15ms, 20ms});
        consume(60ms);  // which waits for nothing
        EXPECT_LE(keeper.throttled(), 15u) << "once for each 15 ms, and not for each 2";
        keeper.stop();
    }}.join();
}

/// Waits announced, as a loop's are. The CPU time that it took.
Nanoseconds wait(BudgetKeeper& keeper, Nanoseconds length) {
    const Nanoseconds before = thread_cpu_time();
    const Instant until = monotonic_now() + length;
    keeper.before_block(until);
    block_until(until);
    keeper.after_block(monotonic_now());
    return thread_cpu_time() - before;
}

Nanoseconds median(std::vector<Nanoseconds>& values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

TEST(BudgetKeeper, TheWayThroughOneWaitInAPeriodIsNotCharged) {
    keep(
        [](BudgetKeeper& keeper) {
            std::vector<Nanoseconds> waiting, charged;
            for (int i = 0; i < 200; ++i) {
                const Nanoseconds before = keeper.charged();
                waiting.push_back(wait(keeper, 1100us));
                charged.push_back(keeper.charged() - before);
            }
            EXPECT_LT(median(charged), median(waiting) / 2) << to_ns(median(waiting));
        },
        500us, 1ms);
}

TEST(BudgetKeeper, WhatIsNotChargedIsNotChargedLaterEither) {
    keep(
        [](BudgetKeeper& keeper) {
            for (int i = 0; i < 200; ++i) wait(keeper, 1100us);  // 2 ms and more, all together
            const Nanoseconds before = thread_cpu_time();
            const Nanoseconds charged = keeper.charged();
            block_until(monotonic_now() + 20ms);  // unannounced
            wait(keeper, 10ms);
            EXPECT_LE(keeper.charged() - charged, thread_cpu_time() - before + 100us);
        },
        500us, 1ms);
}

TEST(BudgetKeeper, ALoopThatOnlyWaitsPaysForItsWaits) {
    keep([](BudgetKeeper& keeper) {
        Nanoseconds waiting{0};
        int waits = 0;
        for (; waiting < kBudget / 2; ++waits) waiting += wait(keeper, 50us);
        wait(keeper, 1us);
        EXPECT_GE(keeper.charged(), (waiting * (waits - 3)) / waits * 9 / 10)
            << to_ns(waiting) << " in " << waits;
    });
}

}  // namespace
}  // namespace qduino::board::linux::test::budget_keeper_test
