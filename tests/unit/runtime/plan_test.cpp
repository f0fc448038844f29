#include "runtime/plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "runtime/lock_declaration.h"

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

using Overheads = std::vector<sched::PlatformOverheads>;

/// The loops declared, and all of it judged on `cores` cores.
Result<void> admit(Plan& plan, std::size_t cores, const SketchTable& table) {
    QDUINO_TRY(plan.add_loops(table));
    return plan.admit(Overheads(cores));
}

std::string refusal_of(std::size_t cores, const SketchTable& table) {
    Plan plan(true);
    return std::string(admit(plan, cores, table).error().message.view());
}

const board::VcpuSpec& spec_of(const std::vector<board::VcpuSpec>& specs, board::VcpuId id) {
    for (const board::VcpuSpec& spec : specs) {
        if (spec.id == id) return spec;
    }
    throw std::out_of_range("no such VCPU");
}

TEST(Plan, ThePrintersLoopsAreAdmittedAndPlaced) {
    Plan plan(true);
    ASSERT_TRUE(
        plan.add_loops(sketch({loop(1, 30ms, 100ms, 0), loop(2, 100us, 100us, 1), loop(3, 1ms, 8ms, 0)})));
    const auto i2c = plan.add_io(1ms, 100ms, 0);
    ASSERT_TRUE(i2c);
    EXPECT_EQ(i2c.value(), 33);
    ASSERT_TRUE(plan.admit(Overheads(2)));
    const auto specs = plan.specs();
    ASSERT_EQ(specs.size(), 4u);
    EXPECT_TRUE(spec_of(specs, 2).owns_core);
    EXPECT_FALSE(spec_of(specs, 1).owns_core);
    EXPECT_EQ(spec_of(specs, 1).core, 0);
    EXPECT_EQ(spec_of(specs, 3).core, 0);
    EXPECT_EQ(spec_of(specs, 33).kind, board::VcpuKind::io);
    EXPECT_EQ(spec_of(specs, 33).client_period, 8ms);  // it works for loop 3, the first on its core
    EXPECT_EQ(plan.owner_of(1), 2);
    EXPECT_EQ(plan.owner_of(0), board::kNoVcpu);
    EXPECT_EQ(vcpu_name(3), "loop 3");
    EXPECT_EQ(vcpu_name(33), "io 33");
}

TEST(Plan, LoopsWithoutACoreGoWhereTheyFit) {
    Plan plan(true);
    ASSERT_TRUE(admit(plan, 2, sketch({loop(1, 80ms, 100ms), loop(2, 50ms, 100ms)})));
    const auto specs = plan.specs();
    EXPECT_NE(spec_of(specs, 1).core, spec_of(specs, 2).core);
}

TEST(Plan, ARefusalSaysWhereTheLoopIsDeclaredAndWhy) {
    Plan plan(true);
    const Result<void> refused = admit(plan, 1,
                                       sketch({loop(1, 30ms, 100ms, 0), loop(2, 20ms, 100ms, 0),
                                               loop(3, 4ms, 10ms, 0), loop(4, 10001us, 100ms, 0)}));
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::out_of_range);
    EXPECT_THAT(std::string(refused.error().message.view()), HasSubstr("a.ino:14: loop 4"));
    EXPECT_THAT(std::string(plan.explanation().view()), HasSubstr("loop 4"));
}

TEST(Plan, MistakesInDeclarationsAreNamed) {
    EXPECT_THAT(refusal_of(1, sketch({})), HasSubstr("declares no loop"));
    EXPECT_THAT(refusal_of(1, sketch({loop(1, 1ms, 10ms), loop(1, 1ms, 10ms)})),
                HasSubstr("a.ino:11: loop 1 was declared before"));
    EXPECT_THAT(refusal_of(1, sketch({loop(33, 1ms, 10ms)})), HasSubstr("1…32"));
    EXPECT_THAT(refusal_of(1, sketch({loop(1, 11ms, 10ms)})), HasSubstr("a.ino:11"));
    EXPECT_THAT(refusal_of(2, sketch({loop(1, 1ms, 10ms, 2)})), HasSubstr("a.ino:11"));
    SketchTable many = sketch({loop(1, 1ms, 10ms)});
    many.dropped = 2;
    EXPECT_THAT(refusal_of(1, many), HasSubstr("32 is the most"));
}

TEST(Plan, AnIoVcpuThatDoesNotFitRefusesThePlan) {
    Plan plan(true);
    ASSERT_TRUE(plan.add_loops(sketch({loop(1, 60ms, 100ms, 0)})));
    ASSERT_TRUE(plan.add_io(50ms, 100ms, 0));
    EXPECT_FALSE(plan.admit(Overheads(1)));
    EXPECT_EQ(plan.admission().refusal.vcpu.id, 1);  // who would be late
    plan.remove_io(33);
    EXPECT_TRUE(plan.admit(Overheads(1)));
}

TEST(Plan, NothingElseMayRunOnAnOwnedCore) {
    EXPECT_THAT(refusal_of(2, sketch({loop(1, 1ms, 1ms, 1), loop(2, 1ms, 10ms, 1)})), HasSubstr("loop 2"));
    Plan plan(true);
    ASSERT_TRUE(admit(plan, 2, sketch({loop(1, 1ms, 1ms, 1), loop(2, 1ms, 10ms)})));
    EXPECT_EQ(spec_of(plan.specs(), 2).core, 0);
    ASSERT_TRUE(plan.add_io(1ms, 100ms, 1));
    EXPECT_FALSE(plan.admit(Overheads(2)));
}

TEST(Plan, ALockThatSaysNothingCountsWithWholeBudgets) {
    Plan plan(true);
    const SketchTable table = sketch({loop(1, 2ms, 10ms, 0), loop(2, 20ms, 100ms, 0)});
    ASSERT_TRUE(plan.add_loops(table));
    LockDeclaration lock;
    const auto add = [&](const sched::CriticalSection& section) { plan.add_section(section); };
    LockDeclaration::each_section(table, add);
    EXPECT_FALSE(plan.admit(Overheads(1)));  // loop 1 may wait for 20 ms
}

TEST(Plan, ALockIsCountedAsItIsDeclared) {
    Plan plan(true);
    const SketchTable table = sketch({loop(1, 2ms, 10ms, 0), loop(2, 20ms, 100ms, 0)});
    ASSERT_TRUE(plan.add_loops(table));
    LockDeclaration lock;
    lock.held_by(1, 1ms);
    lock.held_by(2, 5ms);
    LockDeclaration::each_section(table, [&](const sched::CriticalSection& s) { plan.add_section(s); });
    ASSERT_TRUE(plan.admit(Overheads(1)));
    EXPECT_EQ(plan.admission().cores[0].loops[0].response, 7ms);
}

TEST(Plan, ALoopIsDeferrableWhereTheOthersCanBearIt) {
    Plan plan(true);
    ASSERT_TRUE(admit(plan, 1, sketch({loop(1, 6ms, 20ms, 0), loop(2, 8ms, 30ms, 0)})));
    EXPECT_TRUE(spec_of(plan.specs(), 2).deferrable);  // nobody is below it
    Plan full(true);
    ASSERT_TRUE(admit(full, 1, sketch({loop(1, 10ms, 20ms, 0), loop(2, 20ms, 40ms, 0)})));
    EXPECT_FALSE(spec_of(full.specs(), 1).deferrable);
}

TEST(Plan, NotEnforcedEverythingIsPlaced) {
    Plan plan(false);
    ASSERT_TRUE(admit(plan, 1, sketch({loop(1, 90ms, 100ms, 0), loop(2, 90ms, 100ms)})));
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
    Plan late(true), in_time(true);
    ASSERT_TRUE(late.add_loops(sketch({loop(1, 10ms, 50ms, 0)})));
    EXPECT_FALSE(late.admit(overheads));
    ASSERT_TRUE(in_time.add_loops(sketch({loop(1, 10ms, 70ms, 0)})));
    EXPECT_TRUE(in_time.admit(overheads));
}

}  // namespace
}  // namespace qduino::runtime
