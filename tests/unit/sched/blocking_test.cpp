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

constexpr VcpuId kHandler = 33;

TEST(Blocking, AHandlerMayBeWaitedForAtEachRequest) {
    const std::vector<CriticalSection> sections{
        {1, kA, 1ms}, {1, kB, 1ms}, {2, kB, 2ms}, {kHandler, kA, 5ms}};
    const std::array<VcpuId, 1> handlers{kHandler};
    const Blocking blocking(kThree, sections, handlers);
    EXPECT_EQ(blocking.by_handlers(0), 2 * 5ms);  // also while it waits for loop 2
    EXPECT_EQ(blocking.by_handlers(1), 5ms);      // a chain over loop 1
    EXPECT_EQ(blocking.by_handlers(2), 0ms);
    EXPECT_EQ(blocking.of_handler(kHandler), 1ms + 2ms);
    EXPECT_EQ(Blocking(kThree, sections).by_handlers(0), 0ms) << "of another core";
}

/// It may rank above every loop: what a lower loop locks with it delays those between.
TEST(Blocking, WhatALowerLoopLocksWithAHandlerBlocks) {
    const std::vector<CriticalSection> sections{{3, kA, 4ms}, {kHandler, kA, 1ms}};
    const std::array<VcpuId, 1> handlers{kHandler};
    EXPECT_EQ(Blocking(kThree, sections, handlers).of(0), 4ms);
    EXPECT_EQ(Blocking(kThree, sections).of(0), 0ms);
}

TEST(Blocking, AHandlerOverrunsForThoseWhoShareItsLocks) {
    const std::vector<CriticalSection> sections{{1, kA, 1ms}, {kHandler, kA, 2ms}, {kHandler, kB, 3ms},
                                                {3, 2, 9ms},  {kHandler, 3, 4ms},  {3, kB, 4ms}};
    EXPECT_EQ(longest_overrun(sections, kHandler), 5ms) << "nobody else takes the third";
    EXPECT_EQ(requests_of(sections, 3), 2);
}

TEST(Blocking, ALoopAboveThatKeepsItsBudgetRunsNoLongerForItsLocks) {
    CoreLoad load = load_of({loop_of(1, 1ms, 100ms), loop_of(2, 10ms, 200ms), loop_of(3, 20ms, 400ms)});
    load.sections.push_back({1, kA, 1ms});
    load.sections.push_back({2, kA, 5ms});
    EXPECT_EQ(completion_time(load, 3).response, 31ms);
}

TEST(Overheads, ALateWakeUpIsInRAtEachBegin) {
    CoreLoad load = load_of({loop_of(1, 10ms, 100ms), loop_of(2, 20ms, 200ms)});
    load.overheads.wake_latency = 2ms;
    EXPECT_FALSE(admitted_by_bound(load));
    EXPECT_EQ(completion_time(load, 1).response, 12ms);
    load.mains[1].suspension = 5ms;
    load.mains[1].sleeps = 3;
    EXPECT_EQ(completion_time(load, 2).response, 20ms + 5ms + 4 * 2ms + 10ms);
    // And it may come so much closer to the next.
    EXPECT_EQ(completion_time(load_of({loop_of(1, 10ms, 100ms), loop_of(2, 89ms, 200ms)}), 2).response, 99ms);
    load = load_of({loop_of(1, 10ms, 100ms), loop_of(2, 87ms, 200ms)});
    load.overheads.wake_latency = 2ms;
    EXPECT_EQ(completion_time(load, 2).response, 87ms + 2ms + 2 * 10ms);
}

TEST(Overheads, ABudgetThatPaysForInterruptsDelaysOthersByMore) {
    CoreLoad load = load_of({loop_of(1, 10ms, 100ms), loop_of(2, 20ms, 200ms)});
    load.overheads.add({.name = "x", .cost = 1ms, .interval = 20ms});
    EXPECT_EQ(load.allowance_of(load.mains[0]), 0ms);
    EXPECT_EQ(completion_time(load, 2).response, 32ms);
    load.overheads.victim_pays = true;
    EXPECT_EQ(load.allowance_of(load.mains[0]), 5ms);
    EXPECT_EQ(completion_time(load, 1).response, 11ms) << "itself, as before";
    EXPECT_EQ(completion_time(load, 2).response, 30ms + 5ms + 2ms);
}

TEST(Overheads, TheEdgesOfABottomHalfAreAnInterferer) {
    CoreLoad load = load_of({loop_of(1, 10ms, 100ms), io_of(33, 1ms, 100ms)});
    EXPECT_EQ(completion_time(load, 1).response, 10ms);
    load.ios[0].edge_cost = 1ms;
    load.ios[0].edge_interval = 5ms;
    EXPECT_EQ(completion_time(load, 1).response, 13ms);
}

}  // namespace
}  // namespace qduino::sched::blocking_test
