#include "runtime/plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <array>

#include "runtime/lock_declaration.h"
#include "sched/admission.h"

namespace qduino::runtime::plan_test {
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

/// The loops declared, and all of it judged, with a core for each of `overheads`.
Result<void> admit(Plan& plan, const Overheads& overheads, const SketchTable& table) {
    QDUINO_TRY(plan.add_loops(table));
    return plan.admit(overheads);
}

/// The same on `cores` cores that cost nothing.
Result<void> admit(Plan& plan, std::size_t cores, const SketchTable& table) {
    return admit(plan, Overheads(cores), table);
}

void each_section(const SketchTable& table, Plan& plan) {
    LockDeclaration::each_section(
        table, board::current(), [&](const sched::CriticalSection& section) { plan.add_section(section); },
        [](const sched::CriticalSection&, void (*)()) {});
}

/// The same with a lock, which loops 1 and 2 hold for so long.
Result<void> admit_with_a_lock(Plan& plan, std::size_t cores, const SketchTable& table, Nanoseconds first,
                               Nanoseconds second) {
    LockDeclaration lock;
    lock.held_by(1, first);
    lock.held_by(2, second);
    each_section(table, plan);
    return admit(plan, cores, table);
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
    EXPECT_EQ(plan.admission().refusal.vcpu.id, 33);  // who would be late
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
    each_section(table, plan);
    EXPECT_FALSE(plan.admit(Overheads(1)));  // loop 1 may wait for 20 ms
}

TEST(Plan, ALockIsCountedAsItIsDeclared) {
    Plan plan(true);
    ASSERT_TRUE(
        admit_with_a_lock(plan, 1, sketch({loop(1, 2ms, 10ms, 0), loop(2, 20ms, 100ms, 0)}), 1ms, 5ms));
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

/// The printer's two loops of core 0, and its print service. With a deferrable server loop 1 counts
/// twice for the service.
TEST(Plan, ServersAreChosenSoThatThoseBelowKeepTheirPlace) {
    const SketchTable table = sketch({loop(1, 30ms, 100ms, 0), loop(3, 1ms, 8ms, 0)});
    Overheads overheads(1);
    overheads[0].interferers.push_back(
        {.name = "interrupts", .cost = 1500us, .interval = 8ms, .jitter = 8ms});
    Plan alone(true);
    ASSERT_TRUE(admit(alone, overheads, table));
    EXPECT_TRUE(spec_of(alone.specs(), 1).deferrable);
    overheads[0].below = {10ms, 100ms};
    Plan beside(true);
    ASSERT_TRUE(admit(beside, overheads, table));
    EXPECT_FALSE(spec_of(beside.specs(), 1).deferrable);
    sched::CoreLoad load = beside.admission().loads[0];
    EXPECT_TRUE(sched::keeps_promise_below(load));
    load.mains[load.mains[0].id == 1 ? 0 : 1].deferrable = true;
    EXPECT_FALSE(sched::keeps_promise_below(load)) << "what the choice is about";
    // What has no place in any case costs the loops nothing.
    overheads[0].below = {90ms, 100ms};
    Plan hopeless(true);
    ASSERT_TRUE(admit(hopeless, overheads, table));
    EXPECT_TRUE(spec_of(hopeless.specs(), 1).deferrable);
}

TEST(Plan, TheRoomForASleepIsWhatFits) {
    Plan plan(true);
    ASSERT_TRUE(admit(plan, 1, sketch({loop(1, 6ms, 20ms, 0), loop(2, 8ms, 30ms, 0)})));
    EXPECT_EQ(plan.room_for_sleep(1), 14ms);
    EXPECT_EQ(plan.room_for_sleep(2), 6ms);
    for (const board::VcpuId id : {board::VcpuId{1}, board::VcpuId{2}}) {
        EXPECT_TRUE(plan.response_with_sleep(id, plan.room_for_sleep(id), 1).meets());
        EXPECT_FALSE(plan.response_with_sleep(id, plan.room_for_sleep(id) + 1us, 1).meets());
    }
    Plan full(true);
    ASSERT_TRUE(admit(full, 1, sketch({loop(1, 10ms, 20ms, 0), loop(2, 20ms, 40ms, 0)})));
    EXPECT_EQ(full.room_for_sleep(1), 0ms) << "loop 2 could not bear it";
}

TEST(Plan, LocksBetweenCoresAreCountedAndTheirLoopsDeferrable) {
    Plan plan(true);
    const SketchTable table =
        sketch({loop(1, 10ms, 50ms, 0), loop(2, 20ms, 100ms, 1), loop(3, 5ms, 40ms, 1)});
    ASSERT_TRUE(admit_with_a_lock(plan, 2, table, 2ms, 3ms));
    // 3 of loop 2, and 5 of loop 3 above it, twice: as a deferrable one it may end late, and its
    // next release begin early.
    EXPECT_EQ(plan.admission().cores[0].loops[0].response, 10ms + 3ms + 2 * 5ms);
    EXPECT_TRUE(spec_of(plan.specs(), 1).deferrable);
    EXPECT_TRUE(spec_of(plan.specs(), 2).deferrable);
    // When the other core has more to bear, loop 1 is judged again, too.
    sched::PlatformOverheads busy;
    busy.interferers.push_back({.name = "interrupts", .cost = 12ms, .interval = 24ms, .jitter = {}});
    const Result<void> refused =
        plan.admit_again(std::array{sched::PlatformOverheads{}, busy}, "with these interrupts", kEpoch);
    EXPECT_FALSE(refused);
    EXPECT_EQ(plan.admission().cores[0].loops[0].response, 23ms);
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

/// R of one bottom half: U·100 + 2·60 (ms), for loop 1 has a deferrable server. So the paper's term
/// decides: 60 + 2·U·100 for each.
class PlanOfBottomHalves : public ::testing::Test {
  protected:
    void admit_with(std::initializer_list<Nanoseconds> budgets) {
        ASSERT_TRUE(plan.add_loops(sketch({loop(1, 60ms, 100ms, 0)})));
        for (const Nanoseconds budget : budgets) ASSERT_TRUE(plan.add_io(budget, 100ms, 0));
        ASSERT_TRUE(plan.admit(Overheads(1)));
    }
    Result<void> change(board::VcpuId id, Nanoseconds budget, Nanoseconds at = 1s) {
        return plan.change_io(id, {budget, 100ms}, kEpoch + at);
    }
    Nanoseconds response() const { return plan.admission().cores[0].ios[0].response; }
    Nanoseconds budget_of(board::VcpuId id) const { return spec_of(plan.specs(), id).budget; }

    Plan plan{true};
};

TEST_F(PlanOfBottomHalves, ABudgetThatFitsIsTaken) {
    admit_with({10ms});
    EXPECT_EQ(response(), 130ms);
    ASSERT_TRUE(change(33, 20ms));
    EXPECT_EQ(response(), 140ms);
    EXPECT_EQ(budget_of(33), 20ms);
    EXPECT_EQ(plan.admission().placed[1].budget, 20ms);
    EXPECT_EQ(plan.admission().loads[0].ios[0].budget, 20ms);
}

TEST_F(PlanOfBottomHalves, ABudgetThatDoesNotFitIsRefusedWithWordsAndChangesNothing) {
    admit_with({10ms});
    const Result<void> refused = change(33, 21ms);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::out_of_range);
    EXPECT_EQ(refused.error().message.view(),
              "with this budget, io 33 on core 0 would need 141 ms of its 100 ms");
    EXPECT_EQ(response(), 130ms);
    EXPECT_EQ(budget_of(33), 10ms);
    EXPECT_EQ(plan.admission().loads[0].ios[0].budget, 10ms);
}

TEST(Plan, ABottomHalfThatWouldMakeALoopLateIsRefusedByTheLoop) {
    Plan plan(true);
    ASSERT_TRUE(plan.add_loops(sketch({loop(1, 1ms, 10ms, 0), loop(2, 60ms, 100ms, 0)})));
    ASSERT_TRUE(plan.add_io(10ms, 100ms, 0));
    ASSERT_TRUE(plan.admit(Overheads(1)));
    // R = 60 + ⌈(R + 9)/10⌉·1 + 3 + 0.3·(R − 3): loop 1 has a deferrable server.
    EXPECT_EQ(std::string(plan.change_io(33, {30ms, 100ms}, kEpoch).error().message.view()),
              "with this budget, loop 2 on core 0 would need 105857.143 us of its 100 ms");
}

TEST_F(PlanOfBottomHalves, WhatIsNoBudgetOrNoIoVcpuIsRefused) {
    admit_with({10ms});
    EXPECT_EQ(change(34, 1ms).error().code, ErrorCode::not_found);
    EXPECT_EQ(change(1, 1ms).error().code, ErrorCode::not_found);
    EXPECT_EQ(change(33, 101ms).error().code, ErrorCode::invalid_argument);
}

TEST_F(PlanOfBottomHalves, ALoweredBudgetIsFreeAPeriodLater) {
    admit_with({10ms, 10ms});
    ASSERT_TRUE(change(33, 5ms, 1s));
    EXPECT_FALSE(change(34, 15ms, 1s + 99ms)) << "a release may have met the old one";
    EXPECT_TRUE(change(34, 15ms, 1s + 100ms));
}

TEST_F(PlanOfBottomHalves, LoweredTwiceItCountsWithTheMostThatItHad) {
    admit_with({10ms, 10ms});
    ASSERT_TRUE(change(33, 9ms, 1s));
    ASSERT_TRUE(change(33, 5ms, 1s + 50ms));
    EXPECT_FALSE(change(34, 11ms, 1s + 120ms));
    EXPECT_TRUE(change(34, 15ms, 1s + 150ms));
}

TEST_F(PlanOfBottomHalves, NorIsItFreeForInterruptsBefore) {
    admit_with({10ms});
    ASSERT_TRUE(change(33, 5ms, 1s));
    sched::PlatformOverheads overheads;
    overheads.interferers.push_back({.name = "tick", .cost = 25ms, .interval = 100ms, .jitter = {}});
    EXPECT_FALSE(plan.admit_again({&overheads, 1}, "with its tick back", kEpoch + 1s + 99ms));
    EXPECT_TRUE(plan.admit_again({&overheads, 1}, "with its tick back", kEpoch + 1s + 100ms));
}

sched::PlatformOverheads with_interrupts(Nanoseconds cost) {
    sched::PlatformOverheads overheads;
    overheads.add({.name = "interrupts", .cost = cost, .interval = 100ms, .jitter = {}});
    return overheads;
}

TEST(Plan, AChangeThatOneCoreRefusesIsKeptOnNone) {
    Plan plan(true);
    ASSERT_TRUE(plan.add_loops(sketch({loop(1, 60ms, 100ms, 0), loop(2, 90ms, 100ms, 1)})));
    ASSERT_TRUE(plan.add_io(1ms, 100ms, 0));
    ASSERT_TRUE(plan.admit({with_interrupts(30ms), {}}));
    // Core 0 would be rid of them, and core 1 cannot bear them.
    const std::array moved{sched::PlatformOverheads{}, with_interrupts(30ms)};
    EXPECT_FALSE(plan.admit_again(moved, "with these interrupts routed so", kEpoch));
    EXPECT_FALSE(plan.change_io(33, {19ms, 100ms}, kEpoch)) << "core 0 has its interrupts still";
}

TEST(Plan, InterruptsThatWereRoutedAwayCountForARelease) {
    Plan plan(true);
    ASSERT_TRUE(plan.add_loops(sketch({loop(1, 70ms, 100ms, 0)})));
    ASSERT_TRUE(plan.admit({with_interrupts(20ms)}));
    const std::array<sched::PlatformOverheads, 1> none{};
    ASSERT_TRUE(plan.admit_again(none, "without them", kEpoch + 1s));
    // As long and as often, and still others.
    std::array others{with_interrupts(20ms)};
    others[0].interferers[0].source = 1;
    EXPECT_FALSE(plan.admit_again(others, "with others", kEpoch + 1s + 99ms)) << "a release bears both";
    EXPECT_TRUE(plan.admit_again(others, "with others", kEpoch + 1s + 100ms));
}

TEST_F(PlanOfBottomHalves, WithoutLoopsTheCoreItselfIsTheLimit) {
    ASSERT_TRUE(plan.add_loops(sketch({loop(1, 60ms, 100ms, 1)})));
    ASSERT_TRUE(plan.add_io(10ms, 100ms, 0));
    ASSERT_TRUE(plan.add_io(20ms, 100ms, 0));
    ASSERT_TRUE(plan.admit(Overheads(2)));
    EXPECT_TRUE(change(33, 80ms));
    EXPECT_THAT(std::string(change(33, 81ms).error().message.view()),
                HasSubstr("core 0 would have more to do"));
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
}  // namespace qduino::runtime::plan_test
