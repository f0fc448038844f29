#include "sched/counted_turns.h"

#include <gtest/gtest.h>

#include "tests/unit/sched/make.h"

namespace qduino::sched::counted_turns_test {
namespace {

constexpr Instant at(Nanoseconds t) { return kEpoch + t; }

Vcpu loop_that_sleeps(Nanoseconds sleep, int times) {
    return {.id = 1, .budget = 2ms, .period = 10ms, .suspension = sleep, .sleeps = times};
}

TEST(CountedTurns, OneInEachPeriodIsCounted) {
    const Vcpu loop = loop_that_sleeps({}, 1);
    CountedTurns turns;
    for (int period = 0; period < 3; ++period) {
        EXPECT_TRUE(turns.counts_wake(loop, at(period * 10ms)));
        turns.release(loop, 0);
        EXPECT_FALSE(turns.counts_wake(loop, at(period * 10ms + 3ms))) << "a sleep that it does not declare";
        EXPECT_FALSE(turns.counts_wake(loop, at(period * 10ms + 9ms)));
    }
}

TEST(CountedTurns, SleepsAndWaitsAreCountedThatWereDeclared) {
    const Vcpu loop = loop_that_sleeps(1ms, 2);
    CountedTurns turns;
    EXPECT_TRUE(turns.counts_wake(loop, at(0ms)));
    for (int period = 0; period < 2; ++period) {
        turns.release(loop, 1);
        EXPECT_TRUE(turns.counts_wake(loop, at(1ms)));
        EXPECT_TRUE(turns.counts_wake(loop, at(2ms)));
        EXPECT_FALSE(turns.counts_wake(loop, at(3ms)));
        EXPECT_TRUE(turns.counts_wait());
        EXPECT_FALSE(turns.counts_wait());
    }
}

TEST(CountedTurns, APauseForWantOfBudgetIsTheTurnOfItsPeriod) {
    const Vcpu loop = loop_that_sleeps({}, 1);
    CountedTurns turns;
    EXPECT_TRUE(turns.counts_wake(loop, at(0ms)));
    turns.release(loop, 0);
    EXPECT_TRUE(turns.counts_pause(loop, at(10ms))) << "a train of pulses, whose release does not end";
    EXPECT_TRUE(turns.counts_pause(loop, at(20ms)));
    EXPECT_FALSE(turns.counts_pause(loop, at(25ms)));
}

}  // namespace
}  // namespace qduino::sched::counted_turns_test
