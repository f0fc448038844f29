// bench-edge: how long after an edge its handler begins, against a plain real-time thread that
// waits for the same edge at the same priority and on the same core.
//
//   bench-edge [--json] [--seconds S] [--rounds N] [--load idle|submission|both]
#include <algorithm>
#include <cstdio>

#include "bench/edge/edges.h"
#include "bench/rig/child.h"
#include "bench/rig/options.h"
#include "bench/rig/samples.h"

namespace qduino::bench {
namespace {

// A PIBS server that used c is not eligible for c/U from then on (sched/pibs.h): with a small share
// a service that took long makes the next edge wait.
constexpr const char* kQuarter = "handler, 25 %";
constexpr const char* kTenth = "handler, 10 %";
constexpr const char* kPlain = "plain thread";

/// The results of one contender in all rounds.
struct Pool {
    const char* who;
    std::vector<std::int64_t> ns;

    void add(const EdgeLatencies& latencies, Report& report) {
        if (!latencies.failure.empty()) return report.add_failure(who, latencies.failure);
        ns.insert(ns.end(), latencies.ns.begin(), latencies.ns.end());
        if (latencies.guarantee.is_object()) report.guarantee = latencies.guarantee;
    }
    [[nodiscard]] Json row(const std::string& load) {
        std::sort(ns.begin(), ns.end());
        return {{"who", who},
                {"load", load},
                {"latency_ns_p50", percentile(ns, 0.5)},
                {"latency_ns_p99", percentile(ns, 0.99)},
                {"latency_ns_p999", percentile(ns, 0.999)},
                {"latency_ns_max", ns.empty() ? 0 : ns.back()},
                {"edges", ns.size()}};
    }
};

/// False: interrupted.
bool play(const Options& options, const std::string& load, Report& report) {
    Pool quarter{kQuarter, {}}, tenth{kTenth, {}}, thread{kPlain, {}};
    for (int round = 0; round < options.rounds; ++round) {
        std::fprintf(stderr, "%-10s %d of %d, %.0f s each …\n", load.c_str(), round + 1, options.rounds,
                     options.seconds);
        quarter.add(run_handler(from_seconds(options.seconds), 2500us), report);
        if (interrupted()) return false;
        tenth.add(run_handler(from_seconds(options.seconds), 1ms), report);
        if (interrupted()) return false;
        thread.add(run_plain_thread(from_seconds(options.seconds)), report);
        if (interrupted()) return false;
    }
    for (Pool* pool : {&quarter, &tenth, &thread}) {
        if (!pool->ns.empty()) report.results.push_back(pool->row(load));
    }
    return true;
}

void add_remarks(Report& report) {
    for (const auto& [load, who] : by_load_and_who(report)) {
        for (const char* handler : {kQuarter, kTenth}) {
            if (!who.contains(handler) || !who.contains(kPlain)) continue;
            const auto more = [&who = who, handler](const char* figure) {
                return (*who.at(handler))[figure].get<std::int64_t>() -
                       (*who.at(kPlain))[figure].get<std::int64_t>();
            };
            report.remarks.push_back(load + ": " + handler + ": " + std::to_string(more("latency_ns_p50")) +
                                     " ns more than a plain thread's at the median, " +
                                     std::to_string(more("latency_ns_p999")) + " at 99.9 %");
        }
    }
}

int run(const Options& options) {
    Report report;
    if (!under_each_load(options, report,
                         [&](const std::string& load) { return play(options, load, report); }))
        return 1;
    add_remarks(report);
    print(report, options.json);
    return 0;
}

}  // namespace
}  // namespace qduino::bench

int main(int argc, char** argv) {
    using namespace qduino::bench;
    return run_benchmark(argc, argv, {.seconds = 3, .rounds = 15},
                         {.description = "Time from an edge to its handler, against a plain real-time thread "
                                         "that waits for the same edge.",
                          .footer = "Example: bench-edge --json > edge.json",
                          .has_load = true},
                         run);
}
