// What the account of a budget and its shell promise together, whatever comes between whatever:
// timer, wake-up, block, lock and path. Every way that a few steps can go is gone, and long ones at
// random; and wrong accounts, which must be caught.
//
//   - no nanosecond is lost or charged twice, but the ways through waits that admission has
//     counted;
//   - a thread never runs on without budget, but with a lock, and then for one budget at most; or
//     by what the way through a wait and the shell itself took;
//   - it is never throttled with budget left, nor beyond its replenishment, nor with a lock before
//     it has overrun by a budget.

#include <gtest/gtest.h>

#include <array>
#include <string>

#include "tests/property/sched/choices.h"
#include "tests/property/sched/kept_thread.h"

namespace qduino::sched::budget_property_test {
namespace {

constexpr std::array kShapes{KeptShape{3, 8, 0}, KeptShape{2, 5, 1}, KeptShape{4, 23, 1}, KeptShape{3, 3, 0}};

template <template <typename> class ShellOf, typename Ways>
std::string violation(const KeptShape& shape, Ways& ways, int steps, int delays) {
    KeptThread<ShellOf, Ways> thread{shape, ways, delays};
    for (int i = 0; i < steps; ++i) thread.step();
    return thread.finish();
}

/// Every way that `steps` steps with up to `delays` ticks within the shell can go. The first
/// violation, or "".
template <template <typename> class ShellOf>
std::string violation_in_every_way(int steps, int delays, std::int64_t* ways_gone = nullptr) {
    for (const KeptShape& shape : kShapes) {
        EveryWay ways;
        do {
            if (ways_gone) ++*ways_gone;
            const std::string broken = violation<ShellOf>(shape, ways, steps, delays);
            if (!broken.empty())
                return broken + ", budget " + std::to_string(shape.budget) + ": " + ways.text();
        } while (ways.next());
    }
    return {};
}

template <typename Host>
using RealShell = BudgetShell<Host>;

TEST(BudgetProperty, HoldsInEveryWayThatFiveStepsCanGo) {
    EXPECT_EQ(violation_in_every_way<RealShell>(5, 0), "");
}

TEST(BudgetProperty, HoldsWhereverATickPassesWithinTheShell) {
    std::int64_t ways = 0;
    EXPECT_EQ(violation_in_every_way<RealShell>(4, 1, &ways), "");
    EXPECT_GT(ways, 500'000);
}

TEST(BudgetProperty, HoldsWhereverTwoTicksPassWithinTheShell) {
    EXPECT_EQ(violation_in_every_way<RealShell>(2, 2), "");
}

TEST(BudgetProperty, HoldsInLongRuns) {
    for (std::uint64_t seed = 1; seed <= 600; ++seed) {
        AnyWay ways{seed};
        const KeptShape shape{1 + ways.pick(8), 9 + ways.pick(60), ways.pick(3)};
        ASSERT_EQ(violation<RealShell>(shape, ways, 400, ways.pick(30)), "") << "seed " << seed;
    }
}

// ---- wrong ones, which must be caught -----------------------------------------------------------

template <oracle::BudgetRules kRules>
struct Ruled {
    template <typename Host>
    using Shell = BudgetShell<Host, oracle::NaiveBudgetAccount<kRules>>;
};

template <oracle::BudgetRules kRules>
bool caught() {
    return !violation_in_every_way<Ruled<kRules>::template Shell>(4, 0).empty();
}

}  // namespace

/// A timer that comes while the path is at work is forgotten.
template <typename Host>
class ForgetfulShell : public BudgetShell<Host> {
    using Shell = BudgetShell<Host>;

  public:
    using Shell::Shell;
    void before_wait(Instant until) {
        at_work_ = true;
        Shell::before_wait(until);
    }
    void after_wait(Instant now) {
        Shell::after_wait(now);
        at_work_ = false;
    }
    void on_timer() {
        if (!at_work_) Shell::on_timer();
    }

  private:
    bool at_work_ = false;
};

namespace {

using Rules = oracle::BudgetRules;
TEST(BudgetProperty, CatchesChargingTwice) { EXPECT_TRUE(caught<Rules{.charges = 2}>()); }
TEST(BudgetProperty, CatchesWaitsThatAreAllFree) {
    EXPECT_TRUE(caught<Rules{.charge_further_waits = false}>());
}
TEST(BudgetProperty, CatchesWaitsThatAreAllCharged) {
    EXPECT_TRUE(caught<Rules{.wait_of_each_period = false}>());
}
TEST(BudgetProperty, CatchesAServerThatIsNotTold) { EXPECT_TRUE(caught<Rules{.wake_the_server = false}>()); }
TEST(BudgetProperty, CatchesThrottlingWithALock) { EXPECT_TRUE(caught<Rules{.finish_with_lock = false}>()); }
TEST(BudgetProperty, CatchesAForgottenUnlock) { EXPECT_TRUE(caught<Rules{.throttle_at_unlock = false}>()); }
TEST(BudgetProperty, CatchesOnePeriodTooMuch) { EXPECT_TRUE(caught<Rules{.sleep_longer_by = 1}>()); }
TEST(BudgetProperty, CatchesAForgottenShot) { EXPECT_NE(violation_in_every_way<ForgetfulShell>(4, 0), ""); }
/// The mutants are wrong by their one broken rule: with all rules kept nothing is caught.
TEST(BudgetProperty, DoesNotCatchTheUnbrokenRules) { EXPECT_FALSE(caught<Rules{}>()); }

}  // namespace
}  // namespace qduino::sched::budget_property_test
