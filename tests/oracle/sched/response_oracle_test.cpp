// Completion-time analysis and the utilisation bound against naive ways to the same answer.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "sched/admission.h"
#include "sched/completion_time.h"
#include "tests/oracle/sched/naive_response.h"
#include "tests/unit/sched/analyse.h"

namespace qduino::sched::oracle::response_oracle_test {
namespace {

struct NaiveSet {
    std::vector<NaiveLoop> loops;  // by priority
    std::vector<NaiveLoop> ios;
};

NaiveSet random_set(std::mt19937_64& random, int most_ios) {
    const auto pick = [&](std::int64_t low, std::int64_t high) {
        return std::uniform_int_distribution<std::int64_t>{low, high}(random);
    };
    NaiveSet set;
    const std::int64_t count = pick(1, 6);
    for (std::int64_t i = 0; i < count; ++i) {
        const std::int64_t period = pick(2, 200);
        set.loops.push_back({pick(1, std::max<std::int64_t>(1, period * 2 / count)), period});
        set.loops.back().budget = std::min(set.loops.back().budget, period);
    }
    std::stable_sort(set.loops.begin(), set.loops.end(),
                     [](const NaiveLoop& a, const NaiveLoop& b) { return a.period < b.period; });
    for (std::int64_t k = pick(0, most_ios); k > 0; --k) set.ios.push_back({pick(1, 3), pick(10, 60)});
    return set;
}

CoreLoad load_of(const NaiveSet& set) {
    CoreLoad load;
    VcpuId id = 0;
    for (const NaiveLoop& loop : set.loops) {
        load.mains.push_back({++id, Nanoseconds{loop.budget}, Nanoseconds{loop.period}, kAnyCore});
    }
    id = 32;
    for (const NaiveLoop& io : set.ios) {
        load.ios.push_back({++id, Nanoseconds{io.budget}, Nanoseconds{io.period}, kAnyCore, VcpuKind::io});
    }
    return load;
}

TEST(ResponseOracle, WithoutIoTheEquationSaysWhatIsSeen) {
    std::mt19937_64 random{1};
    for (int round = 0; round < 3000; ++round) {
        const NaiveSet set = random_set(random, 0);
        const CoreLoad load = load_of(set);
        for (std::size_t i = 0; i < set.loops.size(); ++i) {
            const std::int64_t period = set.loops[i].period;
            const std::int64_t seen = watched_response(set.loops, i, period);
            const LoopResponse response = completion_time(load, static_cast<VcpuId>(i + 1));
            ASSERT_EQ(response.meets(), seen <= period) << "round " << round << ", loop " << i;
            if (!response.meets()) continue;
            ASSERT_EQ(response.response.count(), seen) << "round " << round << ", loop " << i;
        }
    }
}

TEST(ResponseOracle, WithIoTheIterationFindsTheLeastSolution) {
    std::mt19937_64 random{2};
    int found = 0;
    for (int round = 0; round < 2000; ++round) {
        const NaiveSet set = random_set(random, 3);
        const CoreLoad load = load_of(set);
        for (std::size_t i = 0; i < set.loops.size(); ++i) {
            const std::int64_t limit = kResponseLimit * set.loops[i].period;
            const std::int64_t solved = solved_response(set.loops, set.ios, i, limit);
            const LoopResponse response = completion_time(load, static_cast<VcpuId>(i + 1));
            ASSERT_EQ(response.response.count() <= limit, solved <= limit)
                << "round " << round << ", loop " << i;
            if (solved > limit) continue;
            ++found;
            ASSERT_EQ(response.response.count(), solved) << "round " << round << ", loop " << i;
        }
    }
    EXPECT_GT(found, 1000);
}

TEST(ResponseOracle, AServiceIsLateWhereNoWindowUpToItsClientsPeriodIsLongEnough) {
    std::mt19937_64 random{7};
    int in_time = 0, late = 0;
    for (int round = 0; round < 2000; ++round) {
        const NaiveSet set = random_set(random, 3);
        const auto fits = [&](std::size_t k, std::int64_t client) {
            std::int64_t window = 1;
            while (window <= client && naive_service_demand(set.loops, set.ios, k, client, window) > window)
                ++window;
            return window <= client;
        };
        bool all_fit = true;
        for (std::size_t k = 0; k < set.ios.size(); ++k) {
            for (const NaiveLoop& client : set.loops) all_fit &= fits(k, client.period);
        }
        const CoreLoad load = load_of(set);
        const auto found = CompletionTime{load}.late_service();
        ASSERT_EQ(all_fit, !found) << "round " << round;
        ++(all_fit ? in_time : late);
        if (!found) continue;
        ASSERT_FALSE(fits(found->io, found->client.count())) << "round " << round;
        ASSERT_GT(found->response, found->client);
        if (found->response <= kResponseLimit * found->client) {
            const Shares shares = CompletionTime{load}.io_shares(found->io, found->client, found->response);
            Nanoseconds sum{};
            for (const Share& share : shares) sum += share.amount;
            ASSERT_EQ(sum, found->response) << "round " << round;
        }
    }
    EXPECT_GT(in_time, 300);
    EXPECT_GT(late, 300);
}

/// A full core as a board has it: 32 loops and up to 31 bottom halves, sleeps, jitter, costs,
/// interrupts.
CoreLoad full_load(std::mt19937_64& random) {
    const auto pick = [&](std::int64_t low, std::int64_t high) {
        return std::uniform_int_distribution<std::int64_t>{low, high}(random);
    };
    CoreLoad load;
    const std::int64_t percent = pick(40, 110);
    for (VcpuId id = 1; id <= kMainVcpuLimit; ++id) {
        const Nanoseconds period{pick(0, 3) == 0 ? 10'000'000 : pick(1'000'000, 200'000'000)};
        Vcpu loop{id, period * percent / 3200, period, 0};
        loop.deferrable = pick(0, 3) == 0;
        if (loop.deferrable && pick(0, 2) == 0) loop.suspension = Nanoseconds{pick(0, 2'000'000)};
        load.mains.push_back(loop);
    }
    const std::int64_t ios = pick(0, kIoVcpuLimit);
    for (std::int64_t k = 0; k < ios; ++k) {
        const Nanoseconds period{pick(5'000'000, 300'000'000)};
        load.ios.push_back({static_cast<VcpuId>(33 + k), period / pick(200, 2000), period, 0, VcpuKind::io});
        if (pick(0, 3) == 0) load.ios.back().client_period = Nanoseconds{pick(1'000'000, 100'000'000)};
    }
    load.overheads.release_cost = Nanoseconds{pick(0, 20'000)};
    load.overheads.interferers.push_back(
        {"tick", Nanoseconds{pick(0, 30'000)}, 4ms, Nanoseconds{pick(0, 3'000'000)}});
    if (pick(0, 3) == 0) load.overheads.priorities = static_cast<std::size_t>(pick(20, 64));
    return load;
}

/// R of the i-th loop by rank, from below and term by term; limit + 1 when it is above the limit.
std::int64_t slow_response(const CoreLoad& load, std::size_t i, std::int64_t limit) {
    const auto up = [](std::int64_t a, std::int64_t b) { return a <= 0 ? 0 : (a + b - 1) / b; };
    std::vector<Vcpu> loops(load.mains.begin(), load.mains.end());
    std::sort(loops.begin(), loops.end(), [](const Vcpu& a, const Vcpu& b) {
        return std::pair{a.period, a.id} < std::pair{b.period, b.id};
    });
    const std::int64_t overhead = load.overheads.release_cost.count();
    const std::size_t vcpus = loops.size() + load.ios.size(), priorities = load.overheads.priorities;
    const bool told_apart = vcpus <= priorities;
    const bool shares = !told_apart && i + 1 + load.ios.size() >= priorities;
    for (std::int64_t r = 1; r <= limit;) {
        std::int64_t sum = loops[i].budget.count() + overhead + loops[i].suspension.count();
        for (std::size_t j = 0; j < loops.size(); ++j) {
            if (j == i || (j > i && !shares)) continue;
            const std::int64_t jitter = loops[j].deferrable ? (loops[j].period - loops[j].budget).count() : 0;
            sum += up(r + jitter, loops[j].period.count()) * (loops[j].budget.count() + overhead);
        }
        for (const Vcpu& io : load.ios) {
            std::int64_t most = 0;
            for (const Vcpu& client : loops) {
                const std::int64_t t = (io.client_period > 0ns ? io.client_period : client.period).count();
                const bool delays =
                    told_apart ? t < loops[i].period.count() : shares || t <= loops[i].period.count();
                if (!delays) continue;
                const std::int64_t share = std::max(io.budget.count() * t / io.period.count(), overhead + 1);
                most = std::max(most, share + up((r - share) * io.budget.count(), io.period.count()));
            }
            sum += most;
        }
        for (const PlatformInterferer& each : load.overheads.interferers)
            sum += each.cost.count() > 0
                       ? up(r + each.jitter.count(), each.interval.count()) * each.cost.count()
                       : 0;
        if (sum <= r) return r;
        r = sum;
    }
    return limit + 1;
}

TEST(ResponseOracle, OfAFullCoreTheQuickWayFindsWhatTheSlowOneFinds) {
    std::mt19937_64 random{9};
    int met = 0, late = 0;
    for (int round = 0; round < 150; ++round) {
        const CoreLoad load = full_load(random);
        const CompletionTime analysis{load};
        const auto verdicts = analysis.verdicts();
        for (std::size_t i = 0; i < analysis.size(); ++i) {
            const std::int64_t period = analysis.period(i).count();
            const std::int64_t slow = slow_response(load, i, period);
            ASSERT_EQ(verdicts[i].meets(), slow <= period) << "round " << round << ", loop " << i;
            ++(slow <= period ? met : late);
            if (slow > period) continue;
            ASSERT_EQ(verdicts[i].response.count(), slow) << "round " << round << ", loop " << i;
        }
        ASSERT_EQ(analysis.every_loop_meets(),
                  std::ranges::all_of(verdicts, [](const LoopResponse& each) { return each.meets(); }));
    }
    EXPECT_GT(met, 2000);
    EXPECT_GT(late, 200);
}

TEST(ResponseOracle, TheBoundNeverAdmitsWhatRealArithmeticRefuses) {
    std::mt19937_64 random{3};
    int admitted = 0;
    int close = 0;
    for (int round = 0; round < 200'000; ++round) {
        const NaiveSet set = random_set(random, 1);
        long double utilisation = 0;
        for (const NaiveLoop& loop : set.loops) {
            utilisation += static_cast<long double>(loop.budget) / static_cast<long double>(loop.period);
        }
        for (const NaiveLoop& io : set.ios) {
            const long double u = static_cast<long double>(io.budget) / static_cast<long double>(io.period);
            utilisation += (2 - u) * u;
        }
        const long double n = static_cast<long double>(set.loops.size());
        const long double bound = n * (std::pow(2.0L, 1 / n) - 1);
        const bool decided = admitted_by_bound(load_of(set));
        admitted += decided ? 1 : 0;
        if (std::fabs(utilisation - bound) < 1e-12L) {
            ++close;  // too close for long double to judge
            continue;
        }
        ASSERT_EQ(decided, utilisation <= bound) << "round " << round;
    }
    EXPECT_GT(admitted, 1000);
    EXPECT_LT(close, 20'000);
}

/// Two loops of one period T and C together: U <= 2(√2 − 1) is (2T + C)² <= 8T² in whole numbers.
/// Tried with T so long that one nanosecond of C, on either side of the bound, changes U by 10^-14.
TEST(ResponseOracle, TheBoundIsDecidedToTheNanosecond) {
    __extension__ using Wide = __int128;
    std::mt19937_64 random{6};
    for (int round = 0; round < 20'000; ++round) {
        std::uniform_int_distribution<std::int64_t> long_period{kPeriodMax.count() / 2, kPeriodMax.count()};
        const std::int64_t period = long_period(random);
        const auto within = [&](std::int64_t c) {
            return (2 * Wide{period} + c) * (2 * Wide{period} + c) <= 8 * Wide{period} * period;
        };
        std::int64_t most =
            static_cast<std::int64_t>(2 * (std::sqrt(2.0L) - 1) * static_cast<long double>(period)) - 4;
        while (within(most + 1)) ++most;
        for (const std::int64_t budget : {most - 1, most + 1}) {
            const NaiveSet set{{{budget / 3, period}, {budget - budget / 3, period}}, {}};
            ASSERT_EQ(admitted_by_bound(load_of(set)), within(budget)) << "round " << round;
        }
    }
}

TEST(ResponseOracle, WithoutIoTheBoundAdmitsNothingThatCompletionTimeRefuses) {
    std::mt19937_64 random{4};
    int admitted = 0;
    for (int round = 0; round < 100'000; ++round) {
        const NaiveSet set = random_set(random, 0);
        const CoreLoad load = load_of(set);
        if (!admitted_by_bound(load)) continue;
        ++admitted;
        for (std::size_t i = 0; i < set.loops.size(); ++i) {
            ASSERT_TRUE(completion_time(load, static_cast<VcpuId>(i + 1)).meets()) << "round " << round;
        }
    }
    EXPECT_GT(admitted, 1000);
}

/// The smallest change is the smallest: tried one microsecond at a time from nothing.
TEST(ResponseOracle, TheRemedyIsTheLeast) {
    std::mt19937_64 random{5};
    int budgets = 0;
    int periods = 0;
    for (int round = 0; round < 400; ++round) {
        NaiveSet set = random_set(random, round % 2);
        for (auto* list : {&set.loops, &set.ios}) {
            for (NaiveLoop& vcpu : *list) vcpu = {vcpu.budget * 1000, vcpu.period * 1000};
        }
        const CoreLoad load = load_of(set);
        const Admission admission = admit(load);
        if (admission.admitted) continue;
        const Vcpu& refused = admission.refusal.vcpu;
        const auto admits = [&](Nanoseconds less, Nanoseconds more) {
            CoreLoad trial = load;
            Vcpu& changed = refused.is_io() ? trial.ios[refused.id - 33u] : trial.mains[refused.id - 1u];
            changed.budget -= less;
            changed.period += more;
            return is_admissible(trial);
        };
        const std::int64_t budget_us = refused.budget / 1us;
        std::int64_t less = 1;
        while (less < budget_us && !admits(less * 1us, 0us)) ++less;
        const Remedy& remedy = admission.refusal.remedy;
        ASSERT_EQ(remedy.budget_less_by.has_value(), less < budget_us) << "round " << round;
        if (remedy.budget_less_by) {
            ASSERT_EQ(*remedy.budget_less_by, less * 1us) << "round " << round;
            ++budgets;
        }
        if (!remedy.period_more_by) continue;
        std::int64_t more = 1;
        while (!admits(0us, more * 1us)) ++more;
        ASSERT_EQ(*remedy.period_more_by, more * 1us) << "round " << round;
        ++periods;
    }
    EXPECT_GT(budgets, 20);
    EXPECT_GT(periods, 20);
}

}  // namespace
}  // namespace qduino::sched::oracle::response_oracle_test
