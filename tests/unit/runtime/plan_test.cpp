#include "runtime/plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace qduino::runtime {
namespace {

using ::testing::HasSubstr;

void nothing() {}

SketchTable sketch(std::initializer_list<LoopDeclaration> loops) {
    SketchTable table;
    for (const LoopDeclaration& loop : loops) table.loops.push_back(loop);
    return table;
}

LoopDeclaration loop(board::VcpuId id, Nanoseconds budget, Nanoseconds period, int core = kAnyCore) {
    return {{id, budget, period, core}, &nothing, "a.ino", 10 + id};
}

Plan plan_for(std::size_t cores) { return Plan(std::vector<sched::PlatformOverheads>(cores), true); }

const board::VcpuSpec& spec_of(const std::vector<board::VcpuSpec>& specs, board::VcpuId id) {
    for (const board::VcpuSpec& spec : specs) {
        if (spec.id == id) return spec;
    }
    throw std::out_of_range("no such VCPU");
}

std::string message_of(const Result<void>& result) { return std::string(result.error().message.view()); }

TEST(Plan, ThePrintersLoopsAreAdmittedAndPlaced) {
    Plan plan = plan_for(2);
    ASSERT_TRUE(
        plan.add_loops(sketch({loop(1, 30ms, 100ms, 0), loop(2, 100us, 100us, 1), loop(3, 1ms, 8ms, 0)})));
    const auto i2c = plan.add_io(1ms, 100ms, 0);
    ASSERT_TRUE(i2c);
    EXPECT_EQ(i2c.value(), 33);
    const auto specs = plan.specs();
    ASSERT_EQ(specs.size(), 4u);
    EXPECT_TRUE(spec_of(specs, 2).owns_core);
    EXPECT_FALSE(spec_of(specs, 1).owns_core);
    EXPECT_EQ(spec_of(specs, 1).core, 0);
    EXPECT_EQ(spec_of(specs, 3).core, 0);
    EXPECT_EQ(spec_of(specs, 33).kind, board::VcpuKind::io);
    EXPECT_EQ(plan.owner_of(1), 2);
    EXPECT_EQ(plan.owner_of(0), board::kNoVcpu);
    EXPECT_EQ(vcpu_name(3), "loop 3");
    EXPECT_EQ(vcpu_name(33), "io 33");
}

TEST(Plan, LoopsWithoutACoreGoWhereTheyFit) {
    Plan plan = plan_for(2);
    ASSERT_TRUE(plan.add_loops(sketch({loop(1, 80ms, 100ms), loop(2, 50ms, 100ms)})));
    const auto specs = plan.specs();
    EXPECT_NE(spec_of(specs, 1).core, spec_of(specs, 2).core);
}

TEST(Plan, ARefusalSaysWhereTheLoopIsDeclaredAndWhy) {
    Plan plan = plan_for(1);
    const Result<void> refused = plan.add_loops(sketch({loop(1, 30ms, 100ms, 0), loop(2, 20ms, 100ms, 0),
                                                        loop(3, 4ms, 10ms, 0), loop(4, 10001us, 100ms, 0)}));
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::out_of_range);
    EXPECT_THAT(message_of(refused), HasSubstr("a.ino:14: loop 4"));
    EXPECT_THAT(std::string(plan.explanation().view()), HasSubstr("loop 4"));
    EXPECT_TRUE(plan.specs().empty());
}

TEST(Plan, MistakesInDeclarationsAreNamed) {
    EXPECT_THAT(message_of(plan_for(1).add_loops(sketch({}))), HasSubstr("declares no loop"));
    EXPECT_THAT(message_of(plan_for(1).add_loops(sketch({loop(1, 1ms, 10ms), loop(1, 1ms, 10ms)}))),
                HasSubstr("a.ino:11: loop 1 was declared before"));
    EXPECT_THAT(message_of(plan_for(1).add_loops(sketch({loop(33, 1ms, 10ms)}))), HasSubstr("1…32"));
    EXPECT_THAT(message_of(plan_for(1).add_loops(sketch({loop(1, 11ms, 10ms)}))), HasSubstr("a.ino:11"));
    EXPECT_THAT(message_of(plan_for(2).add_loops(sketch({loop(1, 1ms, 10ms, 2)}))), HasSubstr("a.ino:11"));
    SketchTable many = sketch({loop(1, 1ms, 10ms)});
    many.dropped = 2;
    EXPECT_THAT(message_of(plan_for(1).add_loops(many)), HasSubstr("32 is the most"));
}

TEST(Plan, AnIoVcpuThatDoesNotFitLeavesThePlanAsItWas) {
    Plan plan = plan_for(1);
    ASSERT_TRUE(plan.add_loops(sketch({loop(1, 60ms, 100ms, 0)})));
    EXPECT_FALSE(plan.add_io(50ms, 100ms, 0));
    EXPECT_TRUE(plan.admitted());
    ASSERT_EQ(plan.refused_ios().size(), 1u);
    EXPECT_EQ(plan.refused_ios()[0].vcpu.budget, 50ms);
    EXPECT_EQ(plan.refused_ios()[0].refusal.vcpu.id, 1);  // who would be late
    EXPECT_EQ(plan.refused_ios()[0].core, 0);
    ASSERT_EQ(plan.specs().size(), 1u);
    const auto fits = plan.add_io(1ms, 100ms, 0);
    ASSERT_TRUE(fits);
    EXPECT_EQ(fits.value(), 33);
    plan.remove_io(33);
    EXPECT_EQ(plan.specs().size(), 1u);
    EXPECT_TRUE(plan.admitted());
}

TEST(Plan, NothingElseMayRunOnAnOwnedCore) {
    Plan plan = plan_for(2);
    EXPECT_FALSE(plan.add_loops(sketch({loop(1, 1ms, 1ms, 1), loop(2, 1ms, 10ms, 1)})));
    ASSERT_TRUE(plan.add_loops(sketch({loop(1, 1ms, 1ms, 1), loop(2, 1ms, 10ms)})));
    EXPECT_EQ(spec_of(plan.specs(), 2).core, 0);
    EXPECT_FALSE(plan.add_io(1ms, 100ms, 1));
}

TEST(Plan, NotEnforcedEverythingIsPlaced) {
    Plan plan(std::vector<sched::PlatformOverheads>(1), false);
    ASSERT_TRUE(plan.add_loops(sketch({loop(1, 90ms, 100ms, 0), loop(2, 90ms, 100ms)})));
    EXPECT_FALSE(plan.admitted());
    const auto specs = plan.specs();
    ASSERT_EQ(specs.size(), 2u);
    for (const board::VcpuSpec& spec : specs) {
        EXPECT_EQ(spec.core, 0);
        EXPECT_FALSE(spec.owns_core);
    }
}

TEST(Plan, WhatThePlatformTakesCounts) {
    std::vector<sched::PlatformOverheads> overheads(1);
    overheads[0].interferers.push_back(
        {.name = "fair server", .cost = 50ms, .interval = 1s, .jitter = Nanoseconds{0}});
    Plan plan(overheads, true);
    EXPECT_FALSE(plan.add_loops(sketch({loop(1, 10ms, 50ms, 0)})));
    EXPECT_TRUE(plan.add_loops(sketch({loop(1, 10ms, 70ms, 0)})));
}

}  // namespace
}  // namespace qduino::runtime
