// bench-release: how late a periodic loop is released, against cyclictest at the same priority, period and core.
//
//   bench-release [--json] [--seconds S] [--rounds N] [--load idle|submission|both]
#include <algorithm>
#include <array>
#include <cstdio>
#include <map>

#include "bench/release/releases.h"
#include "bench/rig/child.h"
#include "bench/rig/options.h"
#include "bench/rig/samples.h"

namespace qduino::bench {
namespace {

struct Contender {
    const char* who;
    Releases (*run)(Nanoseconds length, Nanoseconds phase);
};
/// cyclictest takes its phase from the run of ours before it.
constexpr std::array kContenders{
    Contender{"qduino", [](Nanoseconds length, Nanoseconds) { return run_qduino(length); }},
    Contender{"cyclictest", &run_cyclictest}};

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

/// The contenders in turn. False: interrupted, or ours did not run.
bool play(const Options& options, const std::string& load, Report& report) {
    std::array<std::vector<std::int64_t>, kContenders.size()> pools;
    for (int round = 0; round < options.rounds; ++round) {
        Nanoseconds phase{0};
        for (std::size_t i = 0; i < kContenders.size(); ++i) {
            std::fprintf(stderr, "%-10s %-10s %.0f s …\n", load.c_str(), kContenders[i].who, options.seconds);
            const Releases releases = kContenders[i].run(from_seconds(options.seconds), phase);
            phase = releases.phase;
            if (interrupted()) return false;
            if (!releases.failure.empty()) {
                if (round == 0)
                    report.remarks.push_back(std::string{"  not run   "} + kContenders[i].who + ": " +
                                             releases.failure);
                continue;
            }
            pools[i].insert(pools[i].end(), releases.latencies_ns.begin(), releases.latencies_ns.end());
            if (releases.guarantee.is_object()) report.guarantee = releases.guarantee;
        }
    }
    for (std::size_t i = 0; i < kContenders.size(); ++i) {
        if (!pools[i].empty()) report.results.push_back(row(kContenders[i].who, load, pools[i]));
    }
    return true;
}

void add_verdicts(Report& report) {
    std::map<std::string, std::map<std::string, const Json*>> at;
    for (const Json& each : report.results) at[each["load"]][each["who"]] = &each;
    for (const auto& [load, who] : at) {
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
    Options options;
    options.rounds = 20;
    const auto leave = parse_options(
        options, argc, argv,
        "Release latency of a periodic loop, against cyclictest at the same priority, period and core.",
        "Example: bench-release --json > release.json", true);
    return leave ? *leave : run(options);
}
