#include "board/linux/interference.h"

#include <gtest/gtest.h>

namespace qduino::board::linux::interference_test {
namespace {

TEST(Interference, IsCountedWithAMargin) {
    const Interference found{
        .measured = true, .per_second = 400, .usual = 8us, .longest = 60us, .worst = 3ms};
    const sched::PlatformInterferer counted = found.counted();
    EXPECT_EQ(counted.cost, 12us);
    EXPECT_NEAR(static_cast<double>(counted.interval.count()), 1e9 / 600, 1);
    EXPECT_EQ(counted.jitter, counted.interval) << "two at once";
    // One rate more than was measured fits into its windows.
    EXPECT_GE(counted.interference(1s), 600 * counted.cost);
}

TEST(Interference, TheLongestThatCameTwiceIsCountedOnceAndAStallOfTheHostIsNot) {
    const Interference found{
        .measured = true, .per_second = 400, .usual = 8us, .longest = 60us, .worst = 3ms};
    const sched::PlatformInterferer once = found.counted_once();
    EXPECT_EQ(once.interference(1ms), 90us);
    EXPECT_EQ(once.interference(10s), 90us);
}

TEST(Interference, ASilentCoreIsCountedOnceASecondAtNothing) {
    EXPECT_EQ((Interference{.measured = true}).counted().interference(10s), Nanoseconds{0});
}

TEST(Interference, OfThisComputerIsFoundOrSaidNotToBe) {
    const Interference found = measure_interference(0, 5ms, 10);
    if (!found.measured) GTEST_SKIP() << "no SCHED_FIFO here";
    EXPECT_GE(found.per_second, 0);
    EXPECT_GE(found.worst, found.longest);
    EXPECT_GE(found.longest, Nanoseconds{0});
    EXPECT_FALSE(measure_interference(100'000, 1ms, 10).measured) << "there is no such core";
}

}  // namespace
}  // namespace qduino::board::linux::interference_test
