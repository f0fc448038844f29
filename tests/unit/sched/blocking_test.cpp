#include "sched/blocking.h"

#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "tests/unit/sched/analyse.h"
#include "tests/unit/sched/make.h"

namespace qduino::sched::blocking_test {
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

/// While loop 2 waits for another core, loop 3 may lock once more what loop 1 wants.
TEST(Blocking, ComesAgainAfterEachWaitForAnotherCore) {
    CoreLoad load = load_of({loop_of(1, 1ms, 100ms), loop_of(2, 10ms, 200ms), loop_of(3, 20ms, 400ms)});
    load.sections.push_back({1, kA, 1ms});
    load.sections.push_back({3, kA, 5ms});
    EXPECT_EQ(completion_time(load, 2).response, 10ms + 5ms + 1ms);
    load.waits.push_back({.loop = 2, .requests = 2, .longest = 4ms, .each = 3ms, .lifted = 0ms});
    EXPECT_EQ(completion_time(load, 2).response, 10ms + 3 * 5ms + 2 * 3ms + 1ms);
    load.waits[0].lifted = 7ms;  // at its begin, and once more, however often it waits
    EXPECT_EQ(completion_time(load, 2).response, 10ms + 3 * 5ms + 2 * 3ms + 2 * 7ms + 1ms);
}

}  // namespace
}  // namespace qduino::sched::blocking_test
