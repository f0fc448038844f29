// Admission of process trees: below every loop, beside each other, and against a naive schedule.
#include "board/linux/computer/tree_admission.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

namespace qduino::board::linux::test::tree_admission_test {
namespace {

using ::testing::HasSubstr;

sched::Vcpu loop(sched::VcpuId id, Nanoseconds budget, Nanoseconds period, int core = 0) {
    return {.id = id, .budget = budget, .period = period, .core = core, .kind = sched::VcpuKind::main};
}

Promise sketch_of(std::vector<sched::Vcpu> vcpus) {
    Promise promise;
    promise.program = "printer";
    promise.vcpus = std::move(vcpus);
    return promise;
}

Promise tree_of(std::string name, Nanoseconds budget, Nanoseconds period, int core = 0) {
    Promise promise;
    promise.trees = {{.name = std::move(name), .core = core, .budget = budget, .period = period}};
    return promise;
}

TEST(TreeAdmission, ThePapersDefaultVcpuFitsBelowThePrintersLoops) {
    const std::vector<Promise> printer{
        sketch_of({loop(1, 30ms, 100ms), loop(2, 100us, 100us, 1), loop(3, 1ms, 8ms)})};
    const TreeVerdict service = admit_tree({"print service", 0, 10ms, 100ms}, printer);
    EXPECT_TRUE(service.admitted) << service.refusal;
    // 10 of its own, 30 of loop 1, and loop 3 six times: 46 <= 6 · 8.
    EXPECT_EQ(service.response, 46ms);
    EXPECT_THAT(service.above, HasSubstr("loop 1 of printer (30 ms in 100 ms)"));
    const TreeVerdict owned = admit_tree({"print service", 1, 10ms, 100ms}, printer);
    EXPECT_FALSE(owned.admitted);
    EXPECT_THAT(owned.refusal, HasSubstr("loop 2 of printer (100 us in 100 us) owns core 1"));
}

TEST(TreeAdmission, EveryLoopComesFirstAlsoOneOfALongerPeriod) {
    const std::vector<Promise> slow{sketch_of({loop(1, 95ms, 1s)})};
    const TreeVerdict late = admit_tree({"make", 0, 10ms, 100ms}, slow);
    EXPECT_FALSE(late.admitted) << "95 + 10 > 100";
    EXPECT_THAT(late.refusal, HasSubstr("At most 5 ms in 100 ms would fit"));
    EXPECT_EQ(admit_tree({"make", 0, 5ms, 100ms}, slow).response, 100ms);
    EXPECT_TRUE(admit_tree({"make", 0, 10ms, 200ms}, slow).admitted);
}

TEST(TreeAdmission, WhoTakesWhatFitsIsAdmitted) {
    const std::vector<Promise> slow{sketch_of({loop(1, 95ms, 1s)})};
    TreeVcpu tree{"service", 0, 10ms, 100ms};
    EXPECT_TRUE(admit_what_fits(tree, 2ms, slow).admitted);
    EXPECT_EQ(tree.budget, 5ms);
    tree.budget = 4ms;
    EXPECT_TRUE(admit_what_fits(tree, 2ms, slow).admitted);
    EXPECT_EQ(tree.budget, 4ms) << "no more than was asked for";
    tree.budget = 10ms;
    const TreeVerdict too_little = admit_what_fits(tree, 6ms, slow);
    EXPECT_FALSE(too_little.admitted);
    EXPECT_EQ(too_little.largest, 5ms);
    EXPECT_EQ(tree.budget, 10ms);
    EXPECT_FALSE(admit_what_fits(tree, 1ms, std::vector{sketch_of({loop(1, 100ms, 1s)})}).admitted);
    EXPECT_EQ(tree.budget, 10ms) << "nothing fits";
}

TEST(TreeAdmission, AnotherTreeMayTakeTwoBudgetsBackToBack) {
    std::vector<Promise> other{tree_of("make", 30ms, 100ms)};
    other[0].trees[0].parent = "/another/slice";
    // 20 + 2 · 30 and a tick, since 80 + 70 > 100.
    EXPECT_EQ(admit_tree({"cc", 0, 20ms, 100ms}, other).response, 80ms + tick_period());
    const TreeVerdict refused = admit_tree({"cc", 0, 41ms, 100ms}, other);
    EXPECT_FALSE(refused.admitted);
    EXPECT_THAT(refused.refusal, HasSubstr("make (30 ms in 100 ms)"));
    EXPECT_TRUE(admit_tree({"cc", 1, 41ms, 100ms}, other).admitted) << "another core";
}

TEST(TreeAdmission, ASiblingTakesNoMoreThanAnEqualShare) {
    const std::vector<Promise> other{tree_of("make", 70ms, 100ms)};
    // 1 of its own, 1 of the other, and the scheduler's lag; as servers, 2 · 70 would be too much.
    EXPECT_EQ(admit_tree({"cc", 0, 1ms, 100ms}, other).response, 26ms + tick_period());
    EXPECT_FALSE(admit_tree({"cc", 0, 50ms, 100ms}, other).admitted) << "70 + 50 > 100";
}

TEST(TreeAdmission, ANewcomerMayNotMakeAnotherLate) {
    const std::vector<Promise> quick{tree_of("quick", 10ms, 40ms)};
    EXPECT_TRUE(admit_tree({"slow", 0, 60ms, 1s}, quick).admitted);
    const TreeVerdict refused = admit_newcomer({"slow", 0, 60ms, 1s}, quick);
    EXPECT_FALSE(refused.admitted);
    EXPECT_THAT(refused.refusal, HasSubstr("would make quick (10 ms in 40 ms) late"));
    EXPECT_TRUE(admit_newcomer({"slow", 0, 10ms, 1s}, quick).admitted);
}

TEST(TreeAdmission, WhatThePlatformTakesCountsOnceForTwoSketches) {
    Promise first = sketch_of({loop(1, 10ms, 100ms)}), second = sketch_of({loop(1, 10ms, 100ms)});
    const sched::PlatformInterferer tick{
        .name = FixedString<23>{"tick"}, .cost = 1ms, .interval = 100ms, .jitter = {}};
    first.takers = second.takers = {{0, tick}};
    const TreeVerdict verdict = admit_tree({"make", 0, 10ms, 100ms}, std::vector{first, second});
    EXPECT_EQ(verdict.response, 31ms);
}

TEST(TreeAdmission, MoreThanTheAnalysisTakesIsRefused) {
    std::vector<Promise> many;
    for (int i = 0; i < 33; ++i) many.push_back(sketch_of({loop(1, 1ms, 1s)}));
    EXPECT_THAT(admit_tree({"make", 0, 1ms, 100ms}, many).refusal, HasSubstr("more VCPUs"));
    // Nine servers are more than its table has places: they share them, and each counts.
    many.assign(9, tree_of("t", 1ms, 1s));
    for (Promise& each : many) each.trees[0].parent = "/another/slice";
    EXPECT_GE(admit_tree({"make", 0, 1ms, 100ms}, many).response, 10ms);
    EXPECT_FALSE(admit_tree({"make", 0, 1ms, 9ms}, many).admitted);
}

/// The time at which work of `budget` is done below loops that are all released at 0 and always
/// take their whole budget: millisecond by millisecond.
int done_at(int budget, const std::vector<std::pair<int, int>>& loops, int limit) {
    std::vector<int> left(loops.size(), 0);
    for (int now = 0; now < limit; ++now) {
        bool taken = false;
        for (std::size_t i = 0; i < loops.size(); ++i) {
            if (now % loops[i].second == 0) left[i] += loops[i].first;
            if (taken || left[i] == 0) continue;
            --left[i];
            taken = true;
        }
        if (!taken && --budget == 0) return now + 1;
    }
    return limit + 1;
}

TEST(TreeAdmission, AgreesWithANaiveSchedule) {
    for (std::uint32_t seed = 1; seed <= 500; ++seed) {
        std::mt19937 random{seed};
        const auto any = [&random](int low, int high) {
            return low + static_cast<int>(random() % static_cast<std::uint32_t>(high - low + 1));
        };
        std::vector<std::pair<int, int>> loops(static_cast<std::size_t>(any(0, 4)));
        std::vector<sched::Vcpu> vcpus;
        for (std::size_t i = 0; i < loops.size(); ++i) {
            loops[i].second = any(2, 60);
            loops[i].first = any(1, std::max(1, loops[i].second / 3));
            vcpus.push_back(
                loop(static_cast<sched::VcpuId>(i + 1), loops[i].first * 1ms, loops[i].second * 1ms));
        }
        const int period = any(1, 100), budget = any(1, period);
        const int expected = done_at(budget, loops, period);
        const TreeVerdict verdict =
            admit_tree({"tree", 0, budget * 1ms, period * 1ms}, std::vector{sketch_of(vcpus)});
        EXPECT_EQ(verdict.admitted, expected <= period) << "seed " << seed;
        EXPECT_TRUE(!verdict.admitted || verdict.response == expected * 1ms) << "seed " << seed;
    }
}

}  // namespace
}  // namespace qduino::board::linux::test::tree_admission_test
