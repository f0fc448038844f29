// Chains by hand: each term of the bound, and what takes it away.
#include "sched/chain.h"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

namespace qduino::sched::chain_test {
namespace {

/// Loops and bottom halves on two cores, admitted.
std::unique_ptr<MulticoreAdmission> admitted(const std::vector<Vcpu>& requests,
                                             const CriticalSections& sections = {},
                                             std::size_t priorities = kMainVcpuLimit) {
    auto admission = std::make_unique<MulticoreAdmission>();
    std::vector<PlatformOverheads> overheads(2);
    for (PlatformOverheads& each : overheads) each.priorities = priorities;
    admit_all(requests, overheads, sections, *admission);
    EXPECT_TRUE(admission->admitted);
    return admission;
}

ChainStages through(std::initializer_list<VcpuId> ids) {
    ChainStages stages;
    for (const VcpuId id : ids) stages.push_back({.vcpu = id});
    return stages;
}

Vcpu loop(VcpuId id, Nanoseconds budget, Nanoseconds period, int core) { return {id, budget, period, core}; }
Vcpu io(VcpuId id, Nanoseconds budget, Nanoseconds period, int core) {
    return {id, budget, period, core, VcpuKind::io};
}

TEST(Chain, OneLoopReactsWithinItsPeriodAndItsResponse) {
    const auto admission = admitted({loop(1, 2ms, 10ms, 0), loop(2, 3ms, 20ms, 0)});
    const ChainBound bound = bound_of(*admission, through({2}));
    ASSERT_TRUE(bound.known());
    EXPECT_EQ(bound.reaction, 20ms + 5ms);
    EXPECT_EQ(bound.age, 5ms);
}

TEST(Chain, ALoopThatRanksAboveTheNextOfItsCoreIsDoneBeforeItBegins) {
    // R: 2, 5 ms.
    const auto admission = admitted({loop(1, 2ms, 10ms, 0), loop(2, 3ms, 25ms, 0), loop(3, 1ms, 25ms, 1)});
    const ChainBound down = bound_of(*admission, through({1, 2}));
    EXPECT_EQ(down.reaction, 10ms + 25ms + 5ms);
    EXPECT_EQ(down.age, 10ms + 5ms);
    // Upwards, and to another core, R of the first counts; 5 ms is the gcd.
    const ChainBound up = bound_of(*admission, through({2, 1}));
    EXPECT_EQ(up.reaction, 25ms + (5ms + 10ms) + 2ms);
    EXPECT_EQ(up.age, (5ms + 25ms) + 2ms);
    // 2 + 25 ms is no distance of two releases: 25 ms is.
    EXPECT_EQ(bound_of(*admission, through({1, 3})).reaction, 10ms + 25ms + 1ms);
    // Two of one period on two cores: 5 + 25 ms is none either.
    EXPECT_EQ(bound_of(*admission, through({2, 3})).reaction, 25ms + 25ms + 1ms);
}

TEST(Chain, OneThatSleepsOrSharesItsPriorityIsNotDoneBefore) {
    auto sleeper = loop(1, 2ms, 10ms, 0);
    sleeper.suspension = 3ms;
    sleeper.deferrable = true;
    const auto asleep = admitted({sleeper, loop(2, 3ms, 25ms, 0)});
    EXPECT_EQ(bound_of(*asleep, through({1, 2})).reaction_steps[1], 25ms + 5ms);
    const auto one_priority = admitted({loop(1, 2ms, 10ms, 0), loop(2, 3ms, 25ms, 0)}, {}, 1);
    EXPECT_EQ(bound_of(*one_priority, through({1, 2})).reaction_steps[1], 25ms + 5ms);
}

TEST(Chain, OneThatWaitsForALockOfAnotherCoreIsNotDoneBefore) {
    CriticalSections sections;
    sections.push_back({1, 0, 1ms});
    sections.push_back({3, 0, 1ms});
    const auto admission =
        admitted({loop(1, 2ms, 10ms, 0), loop(2, 1ms, 21ms, 0), loop(3, 2ms, 50ms, 1)}, sections);
    EXPECT_GT(bound_of(*admission, through({1, 2})).reaction_steps[1], 21ms);
}

TEST(Chain, TheOldestItemOfARingHasWaitedForTheReader) {
    const auto admission = admitted({loop(1, 2ms, 10ms, 0), loop(2, 3ms, 100ms, 1)});
    auto stages = through({1, 2});
    EXPECT_EQ(bound_of(*admission, stages).age, 10ms + 3ms);
    stages[1].queued = true;
    EXPECT_EQ(bound_of(*admission, stages).age, 100ms + 3ms);
    EXPECT_EQ(bound_of(*admission, stages).reaction, 10ms + 100ms + 3ms);
}

TEST(Chain, AnEdgeWaitsForNoPeriodAndHasNoAge) {
    const auto admission = admitted({loop(1, 2ms, 10ms, 0), loop(2, 3ms, 20ms, 1), io(33, 1ms, 10ms, 0)});
    const IoResponse half = admission->cores[0].ios[0];
    const ChainBound bound = bound_of(*admission, through({33, 2}));
    ASSERT_TRUE(bound.known());
    EXPECT_EQ(bound.reaction_steps[0], 0ms);
    EXPECT_EQ(bound.reaction, half.replenishment + half.response + 20ms + 3ms);
    EXPECT_FALSE(bound.has_age);
    const ChainBound alone = bound_of(*admission, through({33}));
    EXPECT_EQ(alone.reaction, half.replenishment + half.response);
    EXPECT_EQ(bound_of(*admission, through({1, 33})).fault, ChainFault::io_behind);
}

TEST(Chain, ALoopThatOwnsItsCoreMayHavePasses) {
    const auto admission = admitted({loop(1, 2ms, 10ms, 0), loop(2, 100us, 100us, 1)});
    auto stages = through({1, 2});
    stages[1].pass = 1ms;
    EXPECT_EQ(bound_of(*admission, stages).reaction, 10ms + (2ms + 1ms) + 1ms);
    stages[0].pass = 1ms;
    EXPECT_EQ(bound_of(*admission, stages).fault, ChainFault::no_period);
    EXPECT_EQ(bound_of(*admission, through({1, 7})).fault, ChainFault::no_such_vcpu);
    EXPECT_EQ(bound_of(*admission, through({1, 7})).at, 7);
}

TEST(Chain, ALoopThatIsNeverDoneHasNoBound) {
    auto admission = std::make_unique<MulticoreAdmission>();
    const std::vector<Vcpu> requests{loop(1, 9ms, 10ms, 0), loop(2, 5ms, 20ms, 0)};
    admit_all(requests, std::vector<PlatformOverheads>(1), {}, *admission);
    EXPECT_EQ(bound_of(*admission, through({1, 2})).fault, ChainFault::never_in_time);
    EXPECT_TRUE(bound_of(*admission, through({1})).known());
}

TEST(Chain, TheLongestPeriodHoldsAndAMicrosecondMoreDoesNot) {
    const std::vector<Vcpu> requests{loop(1, 2ms, 50ms, 0), loop(2, 3ms, 20ms, 1)};
    const auto admission = admitted(requests);
    const ChainStages stages = through({1, 2});
    const ChainLimits limits{.reaction = 40ms};
    ASSERT_EQ(bound_of(*admission, stages).reaction, 50ms + 20ms + 3ms);
    // T1 + (2 + 20) + 3 <= 40, whatever T1 and T2 have in common: 15 ms at least.
    const Nanoseconds longest = longest_period(*admission, stages, limits, 1);
    const auto with = [&](Nanoseconds period) {
        const auto changed = admitted({loop(1, 2ms, period, 0), loop(2, 3ms, 20ms, 1)});
        return bound_of(*changed, stages).reaction;
    };
    EXPECT_LE(with(longest), limits.reaction);
    EXPECT_GT(with(longest + 1us), limits.reaction);
    EXPECT_GE(longest, 15ms);
    // Loop 2 alone cannot: 50 ms of loop 1 are too long already.
    EXPECT_EQ(longest_period(*admission, stages, limits, 2), 0ms);
    EXPECT_EQ(longest_period(*admission, stages, limits, 9), 0ms);
    // All is as it was.
    EXPECT_EQ(bound_of(*admission, stages).reaction, 50ms + 20ms + 3ms);
    EXPECT_EQ(admission->loads[0].mains[0].period, 50ms);
}

}  // namespace
}  // namespace qduino::sched::chain_test
