#include "sched/admission.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/sched/analyse.h"
#include "tests/unit/sched/make.h"

namespace qduino::sched::admission_test {
namespace {

Nanoseconds sum_of(const Shares& shares) {
    Nanoseconds sum{0};
    for (const Share& share : shares) sum += share.amount;
    return sum;
}

CoreLoad golden() {
    return load_of({loop_of(1, 30ms, 100ms), loop_of(2, 20ms, 100ms), loop_of(3, 4ms, 10ms)});
}

TEST(Admission, GoldenSetIsRefusedByTheBoundAndAdmittedByCompletionTime) {
    const Admission admission = admit(golden());
    EXPECT_FALSE(admitted_by_bound(golden()));
    EXPECT_TRUE(admission.admitted);
    EXPECT_EQ(admission.by, AdmittedBy::completion_time);
    EXPECT_EQ(admission.utilisation_ppm, 900'000);
    EXPECT_EQ(admission.bound_ppm, 779'763);
    ASSERT_EQ(admission.loops.size(), 3u);
    EXPECT_EQ(admission.loops[0].id, 3);
    EXPECT_EQ(admission.loops[0].response, 4ms);
    EXPECT_EQ(admission.loops[1].id, 1);
    EXPECT_EQ(admission.loops[1].response, 50ms);
    EXPECT_EQ(admission.loops[2].id, 2);
    EXPECT_EQ(admission.loops[2].response, 86ms);
}

TEST(Admission, GoldenSetWithTenMoreMillisecondsJustFits) {
    CoreLoad load = golden();
    ASSERT_TRUE(load.try_add(loop_of(4, 10ms, 100ms)));
    const Admission admission = admit(load);
    EXPECT_TRUE(admission.admitted);
    EXPECT_EQ(admission.by, AdmittedBy::completion_time);
    EXPECT_EQ(admission.loops.back().id, 4);
    EXPECT_EQ(admission.loops.back().response, 100ms);
}

TEST(Admission, OneMicrosecondMoreIsRefusedAndTheRemedyTakesItBack) {
    CoreLoad load = golden();
    ASSERT_TRUE(load.try_add(loop_of(4, 10ms + 1us, 100ms)));
    const Admission admission = admit(load);
    EXPECT_FALSE(admission.admitted);
    const Refusal& refusal = admission.refusal;
    EXPECT_EQ(refusal.because, RefusedBecause::completion_time);
    EXPECT_EQ(refusal.vcpu.id, 4);
    EXPECT_GT(refusal.response.response, 100ms);
    EXPECT_EQ(refusal.response.period, 100ms);
    EXPECT_EQ(sum_of(refusal.shares), 100ms + 1us);
    ASSERT_TRUE(refusal.remedy.budget_less_by);
    EXPECT_EQ(*refusal.remedy.budget_less_by, 1us);
    ASSERT_TRUE(refusal.remedy.period_more_by);
    load.mains[3].period += *refusal.remedy.period_more_by;
    EXPECT_TRUE(admit(load).admitted);
    load.mains[3].period -= 1us;
    EXPECT_FALSE(admit(load).admitted);
}

TEST(Admission, OneLoopMayTakeTheWholeCore) {
    const Admission admission = admit(load_of({loop_of(1, 100us, 100us, kAnyCore)}));
    EXPECT_TRUE(admission.admitted);
    EXPECT_EQ(admission.by, AdmittedBy::bound);
    EXPECT_EQ(admission.loops[0].response, 100us);
}

TEST(Admission, BudgetEqualToPeriodWithACoreOwnsIt) {
    const Admission alone = admit(load_of({loop_of(2, 100us, 100us, 1)}));
    EXPECT_TRUE(alone.admitted);
    EXPECT_EQ(alone.by, AdmittedBy::owned);

    const Admission shared = admit(load_of({loop_of(2, 100us, 100us, 1), loop_of(5, 1us, 100ms, 1)}));
    EXPECT_FALSE(shared.admitted);
    EXPECT_EQ(shared.refusal.because, RefusedBecause::core_owned);
    EXPECT_EQ(shared.refusal.vcpu.id, 5);
    EXPECT_EQ(shared.refusal.other, 2);

    const Admission io = admit(load_of({io_of(40, 1us, 100ms, 1), loop_of(2, 100us, 100us, 1)}));
    EXPECT_EQ(io.refusal.because, RefusedBecause::core_owned);
    EXPECT_EQ(io.refusal.vcpu.id, 40);
    EXPECT_TRUE(io.refusal.vcpu.is_io());
}

TEST(Admission, RefusesWhatIsNoVcpu) {
    for (const VcpuParameters bad : {VcpuParameters{0ns, 1ms}, VcpuParameters{2ms, 1ms},
                                     VcpuParameters{-1ns, 1ms}, VcpuParameters{1ms, kPeriodMax + 1ns}}) {
        const Admission admission = admit(load_of({loop_of(1, bad.budget, bad.period)}));
        EXPECT_FALSE(admission.admitted);
        EXPECT_EQ(admission.refusal.because, RefusedBecause::bad_parameters);
    }
    const Admission twice = admit(load_of({loop_of(1, 1ms, 10ms), loop_of(1, 1ms, 10ms)}));
    EXPECT_EQ(twice.refusal.because, RefusedBecause::duplicate_id);
}

TEST(Admission, AnEmptyCoreIsAdmitted) { EXPECT_TRUE(admit(CoreLoad{}).admitted); }

TEST(Admission, IoVcpusAloneAreAdmittedUpToTheWholeCore) {
    EXPECT_TRUE(admit(load_of({io_of(33, 5ms, 10ms), io_of(34, 5ms, 10ms)})).admitted);
    const Admission over = admit(load_of({io_of(33, 5ms, 10ms), io_of(34, 6ms, 10ms)}));
    EXPECT_EQ(over.refusal.because, RefusedBecause::io_overload);
}

TEST(Admission, IoVcpuCountsAsTwoMinusUTimesU) {
    // (2 − 0.1)·0.1 = 0.19; with 0.81 of the loop it is exactly 1 = the bound of one loop.
    EXPECT_TRUE(admitted_by_bound(load_of({loop_of(1, 80ms, 100ms), io_of(33, 1ms, 10ms)})));
    EXPECT_FALSE(admitted_by_bound(load_of({loop_of(1, 81ms + 1us, 100ms), io_of(33, 1ms, 10ms)})));
}

TEST(Admission, CompletionTimeWithAnIoVcpu) {
    // It works for loop 1 (a service of 1 ms), and takes a tenth of the rest: R = 40 + 1 + 0.1·(R −
    // 1).
    CoreLoad load = load_of({loop_of(1, 1ms, 10ms), loop_of(2, 35ms, 100ms), io_of(33, 1ms, 10ms)});
    EXPECT_EQ(completion_time(load, 2).response, 45'444'445ns);
    EXPECT_EQ(sum_of(shares_in_window(load, 2, 45'444'445ns)), 45'444'445ns);
    // For loop 2 it works below it. A loop goes before bottom halves of its period.
    EXPECT_EQ(completion_time(load, 1).response, 1ms);
    load = load_of({loop_of(1, 40ms, 100ms), io_of(33, 1ms, 10ms)});
    EXPECT_EQ(completion_time(load, 1).response, 40ms);
    // Where that cannot be known, it may go first: R = 40 + 10 + 0.1·(R − 10).
    load.overheads.priorities = 1;
    EXPECT_EQ(completion_time(load, 1).response, 54'444'445ns);
}

TEST(Admission, IoVcpuTakesTheWorstOfItsClients) {
    // For loop 3 the longest service is that for loop 2, 4 of its 40 ms: R = 10 + ⌈R/10⌉·2 +
    // ⌈R/40⌉·5 + 4 + 0.1·(R − 4).
    const CoreLoad load = load_of(
        {loop_of(1, 2ms, 10ms), loop_of(2, 5ms, 40ms), loop_of(3, 10ms, 100ms), io_of(33, 1ms, 10ms)});
    EXPECT_EQ(completion_time(load, 3).response, 27'333'334ns);
    EXPECT_EQ(sum_of(shares_in_window(load, 3, 27'333'334ns)), 27'333'334ns);
}

TEST(Admission, ABottomHalfThatGetsTooLittleIsRefused) {
    // Loop 1 goes first and leaves 2 of 10 ms; a service takes 3. R = 3 + 8.
    const Admission admission = admit(load_of({loop_of(1, 8ms, 10ms), io_of(33, 30ms, 100ms)}));
    EXPECT_FALSE(admission.admitted);
    EXPECT_TRUE(admission.loops[0].meets());
    EXPECT_EQ(admission.refusal.because, RefusedBecause::late_service);
    EXPECT_EQ(admission.refusal.vcpu.id, 33);
    EXPECT_EQ(admission.refusal.response.response, 3ms + 2 * 8ms);
    EXPECT_EQ(admission.refusal.response.period, 10ms);
    EXPECT_EQ(sum_of(admission.refusal.shares), 11ms);
    EXPECT_EQ(admission.refusal.remedy.budget_less_by, 10ms);
    EXPECT_TRUE(admit(load_of({loop_of(1, 8ms, 10ms), io_of(33, 20ms, 100ms)})).admitted);
}

TEST(Admission, WhatThePapersTermAdmitsIsNotRefusedForALateService) {
    // Loop 1 may end late and begin early: a service that meets it twice needs 0.3 + 2·6 of its 10
    // ms. Loop 1 itself needs 6 + 2·0.3 by the paper's term.
    CoreLoad load = load_of({loop_of(1, 6ms, 10ms), io_of(33, 3ms, 100ms)});
    load.mains[0].deferrable = true;
    EXPECT_TRUE(is_admissible(load));
    const Admission admission = admit(load);
    EXPECT_TRUE(admission.admitted);
    EXPECT_GT(admission.ios[0].response, 10ms);
    // 6 + 2·2.1 is too much for that.
    load.ios[0].budget = 21ms;
    EXPECT_FALSE(is_admissible(load));
    EXPECT_EQ(admit(load).refusal.because, RefusedBecause::late_service);
}

TEST(Admission, ABottomHalfIsServedInTimeForEachLoopOfItsCore) {
    // For loop 2, beside the other one: R = 10 + ⌈R/10⌉·2 + 51 + 10 + 0.1·(R − 10). With more than
    // 51 ms that is above 100. Loop 2 itself, with 55: R = 55 + ⌈R/10⌉·2 + 2·(1 + 0.1·(R − 1)).
    const auto load = [](Nanoseconds budget) {
        return load_of(
            {loop_of(1, 2ms, 10ms), loop_of(2, budget, 100ms), io_of(33, 1ms, 10ms), io_of(34, 1ms, 10ms)});
    };
    EXPECT_TRUE(admit(load(51ms)).admitted);
    EXPECT_FALSE(is_admissible(load(51ms + 1us)));
    const Admission admission = admit(load(55ms));
    EXPECT_TRUE(admission.loops[1].meets());
    EXPECT_EQ(admission.refusal.because, RefusedBecause::late_service);
    EXPECT_EQ(admission.refusal.response.period, 100ms);
    // A bottom half that names its client is not asked about others.
    CoreLoad named = load(55ms);
    for (Vcpu& io : named.ios) io.client_period = 10ms;
    EXPECT_TRUE(admit(named).admitted);
    EXPECT_TRUE(is_admissible(named));
}

TEST(Admission, PlatformOverheadsAreInTheAnalysis) {
    CoreLoad load = golden();
    load.overheads.release_cost = 10us;
    load.overheads.enforcement_cost = 5us;
    // Loop 2 sees its own activation, one of loop 1 and nine of loop 3: eleven times 15 us more.
    EXPECT_EQ(completion_time(load, 2).response, 86ms + 165us);
    EXPECT_EQ(sum_of(shares_in_window(load, 2, 86ms + 165us)), 86ms + 165us);

    load.overheads.interferers.push_back({"irq/40-nic", 100us, 10ms, 0ns});
    EXPECT_EQ(completion_time(load, 2).response, 86ms + 165us + 900us);
}

TEST(Admission, NoInterruptIsLeftOutOfAFullTable) {
    CoreLoad load = load_of({loop_of(1, 80ms, 100ms)});
    for (int i = 0; i < 8; ++i) load.overheads.add({"nic", 1us, 10ms, 0ns});
    EXPECT_TRUE(admit(load).admitted);
    load.overheads.add({"disk", 3ms, 10ms, 0ns});
    EXPECT_FALSE(admit(load).admitted);
    // The sources together, in windows of any length: never less than what each asks for.
    PlatformOverheads full;
    Nanoseconds asked{0};
    for (int i = 1; i <= 40; ++i) {
        const PlatformInterferer each{"irq", i * 7us, i * i * 100us, i * 3us};
        full.add(each);
        for (const Nanoseconds window : {Nanoseconds{1us}, Nanoseconds{3ms}, Nanoseconds{100ms}}) {
            if (window == Nanoseconds{3ms}) asked += each.interference(window);
            EXPECT_GE(full.interference(window), each.interference(window));
        }
    }
    EXPECT_GE(full.interference(3ms), asked);
    EXPECT_LT(full.interferers.size(), full.interferers.kCapacity) << "the kernel's own has a place";
}

/// In a short window the one pair allows less, in a long one the other.
TEST(Admission, OfTwoPairsTheOneThatAllowsLessHolds) {
    PlatformInterferer bursts{"interrupts", 10us, 1ms, 20ms};
    bursts.peak_interval = 100us;
    bursts.peak_jitter = 1ms;
    EXPECT_EQ(bursts.interference(1us), 110us) << "11 of them, and not 21";
    EXPECT_EQ(bursts.interference(1ms), 200us);
    EXPECT_EQ(bursts.interference(10ms), 300us) << "30, and not 110";
    CoreLoad load = load_of({loop_of(1, 200us, 1ms), loop_of(2, 600us, 2ms)});
    load.overheads.add({"interrupts", 45us, 1ms, 20ms});
    load.overheads.interferers.back().peak_interval = 200us;
    load.overheads.interferers.back().peak_jitter = 100us;
    EXPECT_TRUE(admit(load).admitted);
    load.overheads.interferers.back().peak_interval = Nanoseconds{0};
    EXPECT_FALSE(admit(load).admitted);
    // What bears others as well in a full table is no longer known so well.
    PlatformOverheads full;
    for (int i = 0; i < 20; ++i) full.add(bursts);
    EXPECT_EQ(full.interference(1ms), 7 * 200us - 200us + 14 * 210us);
}

TEST(Admission, TheFairServerRulesOutShortPeriods) {
    CoreLoad load = load_of({loop_of(3, 1ms, 8ms)});
    EXPECT_TRUE(admit(load).admitted);
    load.overheads.interferers.push_back(kernel_fair_server());
    const Admission admission = admit(load);
    EXPECT_FALSE(admission.admitted);
    EXPECT_EQ(admission.refusal.vcpu.id, 3);
    // Both ends of two server periods meet: 2 · 50 ms + C.
    EXPECT_EQ(admission.refusal.response.response, 101ms);
    EXPECT_FALSE(admission.refusal.remedy.budget_less_by);
    EXPECT_TRUE(admission.refusal.remedy.period_more_by);
}

TEST(Admission, ALoopThatStarvesIsRefusedAndSaysSo) {
    const CoreLoad load = load_of({loop_of(1, 10ms, 10ms, kAnyCore), loop_of(2, 1ms, 100ms)});
    const Admission admission = admit(load);
    EXPECT_FALSE(admission.admitted);
    EXPECT_EQ(admission.refusal.vcpu.id, 2);
    EXPECT_GT(admission.refusal.response.response, 16 * 100ms);
    EXPECT_FALSE(admission.refusal.remedy.budget_less_by);
}

TEST(Admission, ThePapersPrinterSketchFits) {
    EXPECT_TRUE(admit(load_of({loop_of(1, 30ms, 100ms), loop_of(3, 1ms, 8ms), io_of(33, 1ms, 100ms),
                               io_of(34, 1ms, 100ms)}))
                    .admitted);
}

TEST(Admission, BoundInMillionthsIsTheLiuLaylandBound) {
    CoreLoad load;
    for (VcpuId n = 1; n <= kMainVcpuLimit; ++n) {
        ASSERT_TRUE(load.try_add(loop_of(n, 1us, 1s)));
        const double exact = n * (std::pow(2.0, 1.0 / n) - 1.0) * 1e6;
        const std::int64_t bound = admit(load).bound_ppm;
        EXPECT_LE(static_cast<double>(bound), exact + 1e-3);
        EXPECT_GT(static_cast<double>(bound), exact - 1.001);
    }
}

TEST(Admission, FullTablesAreStillExact) {
    CoreLoad load;
    for (int i = 0; i < static_cast<int>(kMainVcpuLimit); ++i) {
        ASSERT_TRUE(load.try_add(loop_of(static_cast<VcpuId>(1 + i), 1ms, 64ms)));
    }
    for (int i = 0; i < static_cast<int>(kIoVcpuLimit); ++i) {
        ASSERT_TRUE(load.try_add(io_of(static_cast<VcpuId>(33 + i), 1us, 1ms)));
    }
    EXPECT_FALSE(load.try_add(loop_of(99, 1ms, 64ms)));
    EXPECT_TRUE(admit(load).admitted);
    // The bottom halves work for loops of that period, and go behind them.
    EXPECT_EQ(admit(load).loops.back().response, 32ms);
    // The last of them: a service of 64 us, what 30 others take, and the loops.
    EXPECT_EQ(admit(load).ios.back().response, 35'033'100ns);
}

TEST(Admission, ABottomHalfHasAResponseTime) {
    // It works for loop 1: 1 of its 10 ms; below loop 1, above loop 2, beside the other bottom
    // half.
    const CoreLoad load = load_of(
        {loop_of(1, 2ms, 10ms), loop_of(2, 50ms, 100ms), io_of(33, 10ms, 100ms), io_of(34, 1ms, 20ms)});
    const Admission admission = admit(load);
    ASSERT_EQ(admission.ios.size(), 2u);
    EXPECT_EQ(admission.ios[0].id, 33);
    // R = 1 + 2 + 0.5 + 0.05·(R − 0.5).
    EXPECT_EQ(admission.ios[0].response, 3'657'895ns);
    EXPECT_EQ(admission.ios[0].replenishment, 10ms);
    EXPECT_EQ(admission.ios[1].response, 3'777'778ns);
    EXPECT_TRUE(admit(load_of({io_of(33, 10ms, 100ms)})).ios.empty());
}

TEST(Admission, ABottomHalfBelowAFullCoreIsNeverServed) {
    const Admission admission = admit(load_of({loop_of(1, 10ms, 10ms, kAnyCore), io_of(33, 1ms, 100ms)}));
    EXPECT_GT(admission.ios[0].response, kResponseLimit * 10ms);
    EXPECT_FALSE(admission.admitted);
    EXPECT_EQ(admission.refusal.because, RefusedBecause::late_service);
}

}  // namespace
}  // namespace qduino::sched::admission_test
