// bench-release: how late a periodic loop is released, against cyclictest at the same priority,
// period and core.
//
//   bench-release [--json] [--seconds S] [--rounds N] [--load idle|submission|both]
#include <algorithm>
#include <cstdio>

#include "bench/release/releases.h"
#include "bench/rig/child.h"
#include "bench/rig/options.h"
#include "bench/rig/samples.h"

namespace qduino::bench {
namespace {

Json row(const char* who, const std::string& load, std::vector<std::int64_t>& sorted) {
    std::sort(sorted.begin(), sorted.end());
    return {{"who", who},
            {"load", load},
            {"latency_ns_p50", percentile(sorted, 0.5)},
            {"latency_ns_p99", percentile(sorted, 0.99)},
            {"latency_ns_p999", percentile(sorted, 0.999)},
            {"latency_ns_max", sorted.empty() ? 0 : sorted.back()},
            {"releases", sorted.size()}};
}

/// The results of one contender in all rounds.
struct Pool {
    const char* who;
    std::vector<std::int64_t> latencies_ns;

    void add(const Releases& releases, Report& report) {
        if (!releases.failure.empty()) return report.add_failure(who, releases.failure);
        latencies_ns.insert(latencies_ns.end(), releases.latencies_ns.begin(), releases.latencies_ns.end());
    }
};

/// False: interrupted.
bool play(const Options& options, const std::string& load, Report& report) {
    Pool qduino{"qduino", {}}, cyclictest{"cyclictest", {}};
    for (int round = 0; round < options.rounds; ++round) {
        std::fprintf(stderr, "%-10s %d of %d, %.0f s …\n", load.c_str(), round + 1, options.rounds,
                     options.seconds);
        const Contenders both = run_both(from_seconds(options.seconds));
        if (interrupted()) return false;
        qduino.add(both.qduino, report);
        cyclictest.add(both.cyclictest, report);
        if (both.qduino.guarantee.is_object()) report.guarantee = both.qduino.guarantee;
    }
    for (Pool* pool : {&qduino, &cyclictest}) {
        if (!pool->latencies_ns.empty()) report.results.push_back(row(pool->who, load, pool->latencies_ns));
    }
    return true;
}

void add_verdicts(Report& report) {
    for (const auto& [load, who] : by_load_and_who(report)) {
        if (!who.contains("qduino") || !who.contains("cyclictest")) continue;
        for (const char* figure : {"latency_ns_p50", "latency_ns_p999"}) {
            const double ratio =
                (*who.at("qduino"))[figure].get<double>() / (*who.at("cyclictest"))[figure].get<double>();
            report.remarks.push_back(verdict(ratio <= 1.1, "%s: %s is %.3f of cyclictest's; at most 1.1",
                                             load.c_str(), figure, ratio));
        }
    }
}

int run(const Options& options) {
    Report report;
    if (!under_each_load(options, report,
                         [&](const std::string& load) { return play(options, load, report); }))
        return 1;
    add_verdicts(report);
    print(report, options.json);
    return 0;
}

}  // namespace
}  // namespace qduino::bench

int main(int argc, char** argv) {
    using namespace qduino::bench;
    return run_benchmark(
        argc, argv, {.seconds = 4, .rounds = 20},
        {.description =
             "Release latency of a periodic loop, against cyclictest at the same priority, period and core.",
         .footer = "Example: bench-release --json > release.json",
         .has_load = true},
        run);
}
