// The watch over a budget from outside: what it lets pass, what it holds, and for how long.
#include "sched/budget_watch.h"

#include <gtest/gtest.h>

#include "tests/unit/sched/make.h"

namespace qduino::sched::budget_watch_test {
namespace {

using Verdict = BudgetWatch::Verdict;

constexpr VcpuParameters kTenth{10ms, 100ms};

/// Spins whenever it may, and is seen a tick late, as the kernel tells it. Returns what it used.
Nanoseconds spin_for(Nanoseconds length, VcpuParameters vcpu) {
    BudgetWatch watch{vcpu, 0ns, kEpoch, {}};
    Nanoseconds used{};
    Verdict verdict = Verdict::run;
    for (Instant now = kEpoch; now < kEpoch + length;) {
        const Instant next = std::max(watch.next_look(), now + 1us);
        if (verdict == Verdict::run) used += next - now;
        now = next;
        // The times of a held thread are known in full.
        const Nanoseconds told =
            verdict == Verdict::run ? used / BudgetWatch::kTick * BudgetWatch::kTick : used;
        verdict = watch.look(now, {told});
    }
    return used;
}

TEST(BudgetWatch, LetsTwoBudgetsPassInARow) {
    BudgetWatch watch{kTenth, 0ns, kEpoch, {}};
    EXPECT_EQ(watch.look(kEpoch + 1s, {0ns}), Verdict::run);
    EXPECT_EQ(watch.look(kEpoch + 1020ms, {20ms}), Verdict::run);
    EXPECT_EQ(watch.holds(), 0u);
}

TEST(BudgetWatch, LetsTheHolderOfALockOverrunByOneBudget) {
    BudgetWatch watch{kTenth, 0ns, kEpoch, {}};
    EXPECT_EQ(watch.look(kEpoch + 20ms, {20ms}), Verdict::run);
    EXPECT_EQ(watch.look(kEpoch + 200ms, {20ms}), Verdict::run);
    EXPECT_EQ(watch.holds(), 0u);
}

TEST(BudgetWatch, HoldsAThreadThatTookMoreUntilItHasEarnedABudget) {
    BudgetWatch watch{kTenth, 0ns, kEpoch, {}};
    ASSERT_EQ(watch.look(kEpoch + 46ms, {46ms}), Verdict::run) << "it may have been the host";
    EXPECT_EQ(watch.next_look(), kEpoch + 50ms);
    EXPECT_EQ(watch.look(kEpoch + 50ms, {50ms}), Verdict::hold);
    EXPECT_EQ(watch.holds(), 1u);
    const Instant next = watch.next_look();
    EXPECT_GT(next, kEpoch + 200ms);
    EXPECT_EQ(watch.look(next - 50ms, {50ms}), Verdict::hold);
    EXPECT_EQ(watch.look(next, {50ms}), Verdict::run);
    EXPECT_EQ(watch.holds(), 1u);
    EXPECT_EQ(watch.used(), 50ms);
    EXPECT_EQ(watch.watched(), next - kEpoch);
}

TEST(BudgetWatch, DoesNotHoldAThreadThatAPauseWasChargedToAndThatPaysByItself) {
    BudgetWatch watch{kTenth, 0ns, kEpoch, {}};
    ASSERT_EQ(watch.look(kEpoch + 120ms, {120ms}), Verdict::run);
    // Its keeper sleeps until all is paid, and wakes now and then to see that it is not.
    Nanoseconds used = 120ms;
    Instant now = kEpoch + 120ms;
    for (; now < kEpoch + 1100ms; now += 4ms) {
        ASSERT_EQ(watch.look(now, {used}), Verdict::run) << to_ns(now);
        if (to_ns(now) / 1'000'000 % 100 == 0) used += 100us;
    }
    ASSERT_EQ(watch.look(now, {used + 10ms}), Verdict::run);
    EXPECT_EQ(watch.holds(), 0u);
}

TEST(BudgetWatch, HoldsOneThatGoesOnInSmallPiecesAfterAPause) {
    BudgetWatch watch{kTenth, 0ns, kEpoch, {}};
    ASSERT_EQ(watch.look(kEpoch + 120ms, {120ms}), Verdict::run);
    Nanoseconds used = 120ms;
    Instant now = kEpoch + 120ms;
    while (watch.holds() == 0 && now < kEpoch + 300ms) {
        now += 4ms;
        used += 1ms;  // a quarter of the core, and a tenth is its own
        static_cast<void>(watch.look(now, {used}));
    }
    EXPECT_EQ(watch.holds(), 1u);
    EXPECT_LE(used, 124ms) << "what it may have beyond its share is the grace";
}

TEST(BudgetWatch, KnowsABudgetThatWasRaised) {
    BudgetWatch watch{kTenth, 0ns, kEpoch, {}};
    watch.change(kEpoch + 10ms, {10ms}, {50ms, 100ms});
    EXPECT_EQ(watch.look(kEpoch + 60ms, {60ms}), Verdict::run);
    EXPECT_EQ(watch.holds(), 0u);
    EXPECT_EQ(watch.used(), 60ms);
}

TEST(BudgetWatch, HoldsAThreadThatGoesOnByABudgetThatWasLowered) {
    BudgetWatch watch{{50ms, 100ms}, 0ns, kEpoch, {}};
    watch.change(kEpoch + 10ms, {10ms}, kTenth);
    EXPECT_EQ(watch.look(kEpoch + 60ms, {60ms}), Verdict::run) << "what it had saved up is its own";
    EXPECT_EQ(watch.look(kEpoch + 100ms, {100ms}), Verdict::run);
    EXPECT_EQ(watch.look(kEpoch + 104ms, {104ms}), Verdict::hold);
}

TEST(BudgetWatch, DoesNotHoldAThreadForWhatItOwedByTheGreaterBudget) {
    BudgetWatch watch{{50ms, 100ms}, 0ns, kEpoch, {}};
    EXPECT_EQ(watch.look(kEpoch + 140ms, {140ms}), Verdict::run);  // 21 below nothing: it may be
    watch.change(kEpoch + 140ms, {140ms}, {1ms, 100ms});
    EXPECT_EQ(watch.look(kEpoch + 140ms, {140ms}), Verdict::run);
}

TEST(BudgetWatch, HasNoPatienceWithAThreadThatEscapedUntilItHasRestedForLong) {
    BudgetWatch watch{kTenth, 0ns, kEpoch, {}};
    ASSERT_EQ(watch.look(kEpoch + 46ms, {46ms}), Verdict::run);
    ASSERT_EQ(watch.look(kEpoch + 50ms, {50ms}), Verdict::hold);
    const Instant resumed = watch.next_look();
    ASSERT_EQ(watch.look(resumed, {50ms}), Verdict::run);
    EXPECT_LE(watch.next_look(), resumed + 11ms);
    EXPECT_EQ(watch.look(resumed + 14ms, {64ms}), Verdict::hold);
    ASSERT_EQ(watch.look(resumed + 1s, {64ms}), Verdict::run);
    // As one that keeps to its budget may:
    EXPECT_EQ(watch.look(resumed + 1020ms, {84ms}), Verdict::run);
}

TEST(BudgetWatch, ASpinnerGetsItsShareAndTwoInAHundredMoreAtMost) {
    for (const VcpuParameters vcpu : {VcpuParameters{200us, 1ms}, VcpuParameters{1ms, 10ms}, kTenth,
                                      VcpuParameters{40ms, 100ms}, VcpuParameters{100us, 200us}}) {
        const double share = to_seconds(spin_for(5s, vcpu)) / 5;
        const double own = to_seconds(vcpu.budget) / to_seconds(vcpu.period);
        EXPECT_LE(share, own + 0.02) << to_ns(vcpu.budget);
        EXPECT_GE(share, own - 0.01) << to_ns(vcpu.budget);
    }
}

TEST(BudgetWatch, AThreadThatWasKeptFromRunningForLongMayCatchUp) {
    BudgetWatch watch{kTenth, 0ns, kEpoch, {}};
    EXPECT_EQ(watch.look(kEpoch + 1s, {}), Verdict::run);
    EXPECT_EQ(watch.look(kEpoch + 1080ms, {70ms, 1s}), Verdict::run);
    BudgetWatch slept{kTenth, 0ns, kEpoch, {}};
    EXPECT_EQ(slept.look(kEpoch + 1s, {}), Verdict::run);
    EXPECT_EQ(slept.look(kEpoch + 1080ms, {70ms, 10ms}), Verdict::run);
    EXPECT_EQ(slept.look(kEpoch + 1084ms, {74ms, 10ms}), Verdict::hold);
}

TEST(BudgetWatch, ClocksThatRunBackChangeNothing) {
    BudgetWatch watch{kTenth, 0ns, kEpoch + 1s, {5ms}};
    EXPECT_EQ(watch.look(kEpoch, {0ns}), Verdict::run);
    EXPECT_EQ(watch.used(), 0ns);
    EXPECT_EQ(watch.watched(), 0ns);
}

TEST(BudgetWatch, CountsOneWaitInEachPeriodAtMostAnEightiethOfIt) {
    BudgetWatch frugal{{1ms, 10ms}, 100us, kEpoch, {}};
    BudgetWatch lavish{{1ms, 10ms}, 10ms, kEpoch, {}};
    for (int period = 1; period <= 1000; ++period) {
        const Instant now = kEpoch + period * 10ms;
        EXPECT_EQ(frugal.look(now, {period * 1100us}), Verdict::run);
        static_cast<void>(lavish.look(now, {period * 2ms}));
    }
    EXPECT_GT(lavish.holds(), 0u);
}

}  // namespace
}  // namespace qduino::sched::budget_watch_test
