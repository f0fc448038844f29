// Chains in a plan: the words of their refusals, and what a run sees of them, step by step.
#include "runtime/chain.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "runtime/chain_watch.h"
#include "runtime/plan.h"

namespace qduino::runtime::chain_test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

void nothing() {}

LoopDeclaration loop(board::VcpuId id, Nanoseconds budget, Nanoseconds period, int core) {
    return {{id, budget, period, core}, &nothing, "a.ino", id};
}

Chain chain(std::initializer_list<board::VcpuId> ids, sched::ChainLimits limits = {}) {
    Chain out;
    out.name = "stop button";
    out.source = Chain::Source::read;
    out.from = "pin 2";
    out.to = "pin 9";
    for (const board::VcpuId id : ids) out.stages.push_back({.vcpu = id});
    out.limits = limits;
    return out;
}

class ChainsOfAPlan : public ::testing::Test {
  protected:
    Result<void> admit(const Chain& declared) {
        SketchTable table;
        table.loops.push_back(loop(1, 2ms, 10ms, 0));
        table.loops.push_back(loop(2, 3ms, 40ms, 1));
        QDUINO_TRY(plan_.add_loops(table));
        plan_.add_chain(declared);
        return plan_.admit(std::vector<sched::PlatformOverheads>(2));
    }
    std::string refusal_of(const Chain& declared) {
        const Result<void> admitted = admit(declared);
        return admitted ? "" : std::string(admitted.error().message.view());
    }

    Plan plan_{true};
};

TEST_F(ChainsOfAPlan, OneThatHoldsIsInTheTable) {
    ASSERT_TRUE(admit(chain({1, 2}, {60ms, 20ms})));
    EXPECT_TRUE(plan_.admitted());
    EXPECT_THAT(std::string(plan_.admission_table().view()),
                HasSubstr("chain stop button:\n"
                          "    pin 2 > loop 1 > loop 2 > pin 9\n"
                          "  reaction 53 ms of 60 ms, age 13 ms of 20 ms\n"));
}

TEST_F(ChainsOfAPlan, OneThatIsTooLongIsRefusedWithTheShareOfEachStage) {
    EXPECT_EQ(refusal_of(chain({1, 2}, {50ms, 20ms})), "chain stop button: reaction 53 ms > 50 ms");
    EXPECT_FALSE(plan_.admitted());
    EXPECT_THAT(std::string(plan_.explanation().view()),
                HasSubstr("chain stop button is refused:\n"
                          "    pin 2 > loop 1 > loop 2 > pin 9\n"
                          "  reaction 53 ms > 50 ms, at worst:\n"
                          "    until loop 1 begins                    10 ms\n"
                          "    from loop 1 to loop 2                  40 ms\n"
                          "    until loop 2 ends                       3 ms\n"
                          "    together                               53 ms\n"
                          "  age 13 ms of 20 ms\n"
                          "  longest period with which it would hold, each alone:\n"
                          "    loop 1                                  5 ms\n"
                          "    loop 2                                 35 ms\n"));
}

TEST_F(ChainsOfAPlan, OneThatIsTooOldIsRefusedToo) {
    EXPECT_EQ(refusal_of(chain({2, 1}, {.age = 40ms})), "chain stop button: age 42 ms > 40 ms");
}

TEST_F(ChainsOfAPlan, WithoutEnforcementItIsSaidAlone) {
    plan_ = Plan(false);
    EXPECT_TRUE(admit(chain({1, 2}, {50ms, 20ms})));
    EXPECT_FALSE(plan_.admitted());
    EXPECT_THAT(std::string(plan_.explanation().view()), HasSubstr("is refused"));
}

TEST_F(ChainsOfAPlan, WhatCannotStandSaysWhy) {
    EXPECT_THAT(refusal_of(chain({1, 7})), HasSubstr("there is no loop 7"));
    const auto refusal = [this](auto change) {
        plan_ = Plan(true);
        Chain declared = chain({1});
        change(declared);
        return refusal_of(declared);
    };
    EXPECT_THAT(refusal([](Chain& c) { c.source = Chain::Source::none; }), HasSubstr("from()"));
    EXPECT_THAT(refusal([](Chain& c) { c.stages.clear(); }), HasSubstr("through()"));
    EXPECT_THAT(refusal([](Chain& c) { c.to.clear(); }), HasSubstr("to()"));
    EXPECT_THAT(refusal([](Chain& c) { c.wrong = "more than 8 stages"; }), HasSubstr("more than 8 stages"));
    EXPECT_THAT(refusal([](Chain& c) { c.stages[0].pass = 1ms; }), HasSubstr("does not own its core"));
}

TEST_F(ChainsOfAPlan, TooManyAreRefused) {
    for (std::size_t i = 0; i < kChainLimit; ++i) plan_.add_chain(chain({1}));
    EXPECT_THAT(refusal_of(chain({1})), HasSubstr("more than 16 chains"));
}

TEST_F(ChainsOfAPlan, ALongWayIsBrokenBeforeColumn80) {
    Chain declared = chain({1, 2, 1, 2, 1, 2, 1, 2});
    declared.stages[3].queued = true;
    ASSERT_TRUE(admit(declared));
    const std::string table(plan_.admission_table().view());
    EXPECT_THAT(table, HasSubstr(" > loop 1 > ring > loop 2 > "));
    for (std::size_t from = 0, end = 0; end != std::string::npos; from = end + 1) {
        end = table.find('\n', from);
        EXPECT_LE(std::min(end, table.size()) - from, 80u);
    }
}

// ---- what is seen -------------------------------------------------------------------------------

constexpr Instant at(Nanoseconds t) { return kEpoch + t; }

ChainVerdict bounded(const Chain& declared) { return {.chain = declared, .bound = {}, .wrong = {}}; }

TEST(ChainWatch, AgeIsFromTheReadAndReactionFromTheOneBefore) {
    ChainWatch watch(bounded(chain({1, 2})));
    watch.begins(1, at(1ms));
    watch.ends(1, at(2ms));  // nothing has come yet
    watch.begins(0, at(10ms));
    watch.ends(0, at(12ms));
    watch.begins(1, at(15ms));
    watch.ends(1, at(16ms));
    EXPECT_EQ(watch.age(), 6ms);
    EXPECT_EQ(watch.count(), 0) << "no output before it";
    watch.begins(1, at(25ms));
    watch.ends(1, at(27ms));  // the same value again
    EXPECT_EQ(watch.age(), 17ms);
    EXPECT_EQ(watch.count(), 0);
    watch.begins(0, at(30ms));
    watch.ends(0, at(31ms));
    watch.begins(1, at(35ms));
    watch.ends(1, at(36ms));
    EXPECT_EQ(watch.count(), 1);
    EXPECT_EQ(watch.reaction(), 26ms) << "what changed just behind 10 ms";
}

TEST(ChainWatch, OfARingTheOldestItemCounts) {
    Chain declared = chain({1, 2});
    declared.stages[1].queued = true;
    ChainWatch watch(bounded(declared));
    for (const Nanoseconds read : {10ms, 20ms, 30ms}) {
        watch.begins(0, at(read));
        watch.ends(0, at(read + 1ms));
    }
    watch.begins(1, at(35ms));
    watch.ends(1, at(36ms));
    EXPECT_EQ(watch.age(), 26ms);
}

TEST(ChainWatch, OfAnEdgeTheOldestThatWaits) {
    Chain declared = chain({33, 1});
    declared.source = Chain::Source::edge;
    ChainWatch watch(bounded(declared));
    for (const Nanoseconds came : {10ms, 13ms}) {
        watch.begins_with_edge(at(came));
        watch.ends(0, at(came + 1ms));
    }
    watch.begins(1, at(20ms));
    watch.ends(1, at(22ms));
    EXPECT_EQ(watch.reaction(), 12ms);
    watch.begins(1, at(30ms));
    watch.ends(1, at(32ms));
    EXPECT_EQ(watch.count(), 1) << "no edge came meanwhile";
    watch.begins_with_edge(kForever);
    watch.ends(0, at(33ms));
    watch.begins(1, at(40ms));
    watch.ends(1, at(42ms));
    EXPECT_EQ(watch.count(), 1) << "nobody knows when that one came";
}

TEST(ChainWatch, OfADeviceTheFirstLoopIsTheBeginning) {
    Chain declared = chain({33, 1});
    declared.source = Chain::Source::device;
    ChainWatch watch(bounded(declared));
    watch.begins(1, at(10ms));
    watch.ends(1, at(12ms));
    watch.begins(1, at(20ms));
    watch.ends(1, at(21ms));
    EXPECT_EQ(watch.reaction(), 11ms);
}

}  // namespace
}  // namespace qduino::runtime::chain_test
