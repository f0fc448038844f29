// bench-budget: is a loop that would run for ever kept to its budget, and how finely? Ours against
// the kernel's SCHED_DEADLINE. And what does that cost the loop? Ours against a bare timer.
//
//   bench-budget [--json] [--seconds S] [--rounds N]
//
// The loop itself measures its bursts, by the wall clock. So interrupts and a hypervisor's pauses
// within a burst count as part of it.
#include <algorithm>
#include <array>
#include <cstdio>

#include "bench/budget/busy_loops.h"
#include "bench/rig/child.h"
#include "bench/rig/options.h"
#include "bench/rig/samples.h"

namespace qduino::bench {
namespace {

struct Mechanism {
    const char* name;
    Bursts (*run)(BudgetCase, Nanoseconds);
};

constexpr std::array kMechanisms{Mechanism{"sporadic_server", &run_under_sporadic_server},
                                 Mechanism{"sched_deadline", &run_under_sched_deadline},
                                 Mechanism{"bare_timer", &run_under_bare_timer}};
constexpr std::size_t kOurs = 0, kBare = 2;
constexpr std::array kCases{BudgetCase{200us, 1ms}, BudgetCase{1ms, 8ms}, BudgetCase{30ms, 100ms}};

/// All rounds of one mechanism in one case.
struct Pool {
    std::vector<std::int64_t> lengths_ns;
    double utilisation_sum = 0;
    double overhead_sum_ns = 0;
    int rounds = 0;

    void add(const Bursts& bursts) {
        lengths_ns.insert(lengths_ns.end(), bursts.lengths_ns.begin(), bursts.lengths_ns.end());
        utilisation_sum += bursts.utilisation;
        overhead_sum_ns += bursts.overhead_ns;
        ++rounds;
    }
};

double microseconds(std::int64_t ns) { return static_cast<double>(ns) / 1000; }

Json row(const char* mechanism, BudgetCase budget, Pool& pool) {
    auto& sorted = pool.lengths_ns;
    std::sort(sorted.begin(), sorted.end());
    return {{"mechanism", mechanism},
            {"budget_us", budget.budget.count() / 1000},
            {"period_us", budget.period.count() / 1000},
            {"burst_us_p50", microseconds(percentile(sorted, 0.5))},
            {"burst_us_p999", microseconds(percentile(sorted, 0.999))},
            {"burst_us_max", sorted.empty() ? 0.0 : microseconds(sorted.back())},
            {"utilisation", pool.utilisation_sum / std::max(1, pool.rounds)},
            {"overhead_us", pool.overhead_sum_ns / 1000 / std::max(1, pool.rounds)},
            {"bursts", sorted.size()}};
}

/// The bound that the project sets itself.
std::string verdict_on(const Json& row) {
    const double budget = row["budget_us"], period = row["period_us"];
    const double over = row["burst_us_p999"].get<double>() - budget;
    const double share = row["utilisation"].get<double>() / (budget / period);
    return verdict(
        over <= 30 && std::abs(share - 1) <= 0.01,
        "%.0f/%.0f us: 99.9 %% burst is the budget %+.1f us, at most +30; utilisation %.4f of C/T, within "
        "0.01 of 1",
        budget, period, over, share);
}

std::string verdict_on_the_cost(const Json& ours, const Json& bare) {
    const double cost = ours["overhead_us"], least = bare["overhead_us"], budget = ours["budget_us"];
    return verdict(
        cost <= 33 || cost <= 1.2 * least,
        "%.0f/%.0f us: to be held back costs the loop %.1f us of its budget, a bare timer and sleep "
        "%.1f; at most 33, or 1.2 of that",
        budget, ours["period_us"].get<double>(), cost, least);
}

int run(const Options& options) {
    std::array<std::array<Pool, kMechanisms.size()>, kCases.size()> pools;
    Report report;
    for (int round = 0; round < options.rounds; ++round) {
        for (std::size_t i = 0; i < kCases.size(); ++i) {
            for (std::size_t k = 0; k < kMechanisms.size(); ++k) {
                std::fprintf(stderr, "%-15s %ld/%ld us …\n", kMechanisms[k].name,
                             kCases[i].budget.count() / 1000, kCases[i].period.count() / 1000);
                const Bursts bursts = kMechanisms[k].run(kCases[i], from_seconds(options.seconds));
                if (interrupted()) return 1;
                if (bursts.failure.empty()) {
                    pools[i][k].add(bursts);
                } else {
                    report.add_failure(kMechanisms[k].name, bursts.failure);
                }
                if (bursts.guarantee.is_object()) report.guarantee = bursts.guarantee;
            }
        }
    }
    for (std::size_t i = 0; i < kCases.size(); ++i) {
        std::array<Json, kMechanisms.size()> rows;
        for (std::size_t k = 0; k < kMechanisms.size(); ++k) {
            if (pools[i][k].rounds == 0) continue;
            rows[k] = row(kMechanisms[k].name, kCases[i], pools[i][k]);
            report.results.push_back(rows[k]);
        }
        if (!rows[kOurs].is_object()) continue;
        report.remarks.push_back(verdict_on(rows[kOurs]));
        if (rows[kBare].is_object()) report.remarks.push_back(verdict_on_the_cost(rows[kOurs], rows[kBare]));
    }
    print(report, options.json);
    return 0;
}

}  // namespace
}  // namespace qduino::bench

int main(int argc, char** argv) {
    using namespace qduino::bench;
    return run_benchmark(
        argc, argv, {.seconds = 4, .rounds = 4},
        {.description =
             "Busy loops under a budget: longest burst and utilisation, ours against SCHED_DEADLINE.",
         .footer = "Example: bench-budget --json > budget.json"},
        run);
}
