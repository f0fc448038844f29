#include "sched/blocking.h"

#include <gtest/gtest.h>

#include <array>
#include <vector>

namespace qduino::sched {
namespace {

constexpr std::array<VcpuId, 3> kThree{1, 2, 3};
constexpr std::uint8_t kA = 0, kB = 1;

TEST(Blocking, NoneWithoutLocks) { EXPECT_EQ(Blocking(kThree, {}).of(0), 0ns); }

TEST(Blocking, ALowerLoopsSectionBlocksWhoeverTakesTheLock) {
    const std::vector<CriticalSection> sections{{1, kA, 1ms}, {3, kA, 9ms}};
    const Blocking blocking(kThree, sections);
    EXPECT_EQ(blocking.of(0), 9ms);
    EXPECT_EQ(blocking.of(1), 9ms);  // 3 runs above 2 while 1 waits
    EXPECT_EQ(blocking.of(2), 0ms);
}

TEST(Blocking, ALockOfLowerLoopsAloneBlocksNobodyAboveThem) {
    const std::vector<CriticalSection> sections{{2, kA, 1ms}, {3, kA, 9ms}};
    EXPECT_EQ(Blocking(kThree, sections).of(0), 0ms);
    EXPECT_EQ(Blocking(kThree, sections).of(1), 9ms);
}

TEST(Blocking, AChainAddsUp) {
    const std::vector<CriticalSection> sections{{1, kA, 1ms}, {2, kA, 5ms}, {2, kB, 5ms}, {3, kB, 9ms}};
    EXPECT_EQ(Blocking(kThree, sections).of(0), 14ms);
    EXPECT_EQ(Blocking(kThree, sections).of(1), 9ms);
}

TEST(Blocking, OneLockBlocksOnceHoweverManyLoopsHoldIt) {
    const std::vector<CriticalSection> sections{{1, kA, 1ms}, {2, kA, 5ms}, {3, kA, 9ms}};
    EXPECT_EQ(Blocking(kThree, sections).of(0), 9ms);
}

TEST(Blocking, OneLoopBlocksOnceHoweverManyLocksItTakes) {
    const std::vector<CriticalSection> sections{{1, kA, 1ms}, {1, kB, 1ms}, {3, kA, 9ms}, {3, kB, 7ms}};
    EXPECT_EQ(Blocking(kThree, sections).of(0), 9ms);
}

}  // namespace
}  // namespace qduino::sched
