// No set that is admitted has a schedule with a miss: every set of up to three loops and a bottom
// half, with periods up to 10, in every phasing. And each broken rule is seen in some set.

#include "tests/model/sched/small_model.h"

#include <gtest/gtest.h>

#include <cstdio>

#include "sched/admission.h"

namespace qduino::sched::model {
namespace {

/// A loop that computes its whole budget in each release.
Loop busy(int budget, int period) { return {budget, period, budget}; }

CoreLoad load_of(const Set& set) {
    CoreLoad load;
    VcpuId id = 0;
    for (const Loop& loop : set.loops)
        load.mains.push_back({++id, Nanoseconds{loop.budget}, Nanoseconds{loop.period}});
    for (const Io& io : set.ios)
        load.ios.push_back({++id, Nanoseconds{io.budget}, Nanoseconds{io.period}, kAnyCore, VcpuKind::io});
    return load;
}

std::string words(const Set& set) {
    std::string text;
    for (const Loop& loop : set.loops)
        text += " loop " + std::to_string(loop.budget) + "/" + std::to_string(loop.period);
    for (const Io& io : set.ios) text += " io " + std::to_string(io.budget) + "/" + std::to_string(io.period);
    return text;
}

/// Calls `visit` with every set of `count` busy loops with periods up to `longest`, in order of
/// rank, whose utilisation is at most 1.
template <typename Visit>
void each_set(int count, int longest, Visit visit, Set set = {}) {
    if (count == 0) return visit(set);
    const int shortest = set.loops.empty() ? 2 : set.loops.back().period;
    for (int period = shortest; period <= longest; ++period) {
        for (int budget = 1; budget < period; ++budget) {
            set.loops.push_back(busy(budget, period));
            double utilisation = 0;
            for (const Loop& loop : set.loops) utilisation += static_cast<double>(loop.budget) / loop.period;
            if (utilisation <= 1.0) each_set(count - 1, longest, visit, set);
            set.loops.pop_back();
        }
    }
}

struct Tally {
    int admitted = 0, refused = 0, refused_and_missing = 0;
    std::size_t states = 0;
};

/// Admitted means that no schedule misses. What is refused is counted by whether it was right.
void hold(const Set& set, Tally& tally) {
    const bool admitted = is_admissible(load_of(set));
    ++(admitted ? tally.admitted : tally.refused);
    Explorer explorer{set};
    const auto miss = explorer.miss();
    tally.states += explorer.states();
    EXPECT_TRUE(explorer.complete()) << words(set);
    if (admitted)
        EXPECT_EQ(miss, std::nullopt) << words(set);
    else
        tally.refused_and_missing += miss ? 1 : 0;
}

TEST(SmallModel, NoAdmittedPairOrTripleOfLoopsHasAScheduleWithAMiss) {
    Tally tally;
    each_set(2, 10, [&](const Set& set) { hold(set, tally); });
    // Without anything that blocks, the analysis is exact.
    EXPECT_EQ(tally.refused, tally.refused_and_missing);
    each_set(3, 10, [&](const Set& set) { hold(set, tally); });
    EXPECT_EQ(tally.refused, tally.refused_and_missing);
    EXPECT_GT(tally.admitted, 200);
    EXPECT_GT(tally.refused, 50);
    std::printf("%d admitted, %d refused, %d of these miss, %zu states\n", tally.admitted, tally.refused,
                tally.refused_and_missing, tally.states);
}

TEST(SmallModel, NoAdmittedSetWithABottomHalfHasAScheduleWithAMiss) {
    Tally tally;
    for (int period = 3; period <= 10; ++period) {
        each_set(2, 7, [&](Set set) {
            set.ios.push_back({1, period});
            hold(set, tally);
        });
    }
    EXPECT_GT(tally.admitted, 100);
    std::printf("%d admitted, %d refused, %d of these miss, %zu states\n", tally.admitted, tally.refused,
                tally.refused_and_missing, tally.states);
}

/// In how many of the admitted sets somebody misses when the core keeps `rules`.
template <typename Change>
int sets_that_miss(Rules rules, Change change) {
    int missing = 0;
    each_set(2, 6, [&](Set set) {
        change(set);
        if (is_admissible(load_of(set))) missing += Explorer{set, rules}.miss() ? 1 : 0;
    });
    return missing;
}

/// Asks for five times its budget in each release.
void first_runs_away(Set& set) {
    set.loops[0] = {set.loops[0].budget, set.loops[0].period, 5 * set.loops[0].budget, true};
}

void with_a_bottom_half(Set& set) { set.ios.push_back({1, 6}); }

TEST(SmallModel, ARunawayLoopMakesNoOtherMiss) { EXPECT_EQ(sets_that_miss({}, first_runs_away), 0); }

TEST(SmallModel, SeesAWrongOrder) {
    EXPECT_GT(sets_that_miss({.shorter_period_first = false}, [](Set&) {}), 5);
}

TEST(SmallModel, SeesIdleBudgetThatIsSavedUp) {
    EXPECT_GT(sets_that_miss({.waking_moves_refills = false}, first_runs_away), 5);
}

TEST(SmallModel, SeesABottomHalfThatIsServedTooOften) {
    EXPECT_EQ(sets_that_miss({}, with_a_bottom_half), 0);
    EXPECT_GT(sets_that_miss({.one_replenishment = false}, with_a_bottom_half), 5);
}

}  // namespace
}  // namespace qduino::sched::model
