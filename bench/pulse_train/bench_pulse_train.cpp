// bench-pulse-train: the paper's 10 kHz pulse train (RTAS 2017, sections III.C and V), and what a
// bare spin can do at the same time.
//
//   bench-pulse-train [--json] [--seconds S] [--rounds N] [--load idle|submission|both]
//
// The variants take turns within each round, so that other work on the computer (a hypervisor's
// above all) hits them alike. Their intervals are pooled over the rounds. The train has core 1 (the
// last); this program and the load have the others.
#include <algorithm>
#include <array>
#include <cstdio>
#include <map>

#include "bench/pulse_train/trains.h"
#include "bench/rig/child.h"
#include "bench/rig/options.h"
#include "bench/rig/samples.h"

namespace qduino::bench {
namespace {

struct Variant {
    const char* name;
    Train (*run)(Nanoseconds length, Nanoseconds phase);
};

/// `floor` comes after `absolute`, whose phase it takes.
constexpr std::array kVariants{
    Variant{"listing1", [](Nanoseconds length, Nanoseconds) { return run_listing1(length, true); }},
    Variant{"listing1_plain", [](Nanoseconds length, Nanoseconds) { return run_listing1(length, false); }},
    Variant{"listing2",
            [](Nanoseconds length, Nanoseconds) { return run_sketch("listing-2-linux", length); }},
    Variant{"absolute",
            [](Nanoseconds length, Nanoseconds) { return run_sketch("pulse-train-absolute-linux", length); }},
    Variant{"floor", &run_floor},
    Variant{"floor_relative", [](Nanoseconds length, Nanoseconds) { return run_floor_relative(length); }},
};

/// The intervals of one variant under one load, over all rounds.
struct Pool {
    std::vector<std::int64_t> intervals_ns;
    std::uint64_t lost_edges = 0;

    void add(const Train& train) {
        const auto intervals = sorted_intervals(train.rising_ns);
        intervals_ns.insert(intervals_ns.end(), intervals.begin(), intervals.end());
        lost_edges += train.lost_edges;
    }
    [[nodiscard]] double mean_hz() const {
        double sum_ns = 0;
        for (const std::int64_t interval : intervals_ns) sum_ns += static_cast<double>(interval);
        return sum_ns > 0 ? 1e9 * static_cast<double>(intervals_ns.size()) / sum_ns : 0;
    }
};

using Pools = std::map<std::pair<std::string, std::string>, Pool>;  // by variant and load

Json row(const std::string& variant, const std::string& load, Pool& pool) {
    auto& sorted = pool.intervals_ns;
    std::sort(sorted.begin(), sorted.end());
    return {{"variant", variant},
            {"load", load},
            {"mean_hz", pool.mean_hz()},
            {"interval_ns_p50", percentile(sorted, 0.5)},
            {"interval_ns_p99", percentile(sorted, 0.99)},
            {"interval_ns_p999", percentile(sorted, 0.999)},
            {"interval_ns_p9999", percentile(sorted, 0.9999)},
            {"interval_ns_max", sorted.empty() ? 0 : sorted.back()},
            {"intervals", sorted.size()},
            {"lost_edges", pool.lost_edges}};
}

/// Runs every variant once. False: one could not run; that was reported.
bool play_round(const Options& options, const std::string& load, Pools& pools, Json& guarantee) {
    Nanoseconds phase{0};
    for (const Variant& variant : kVariants) {
        std::fprintf(stderr, "%-10s %-9s %.0f s …\n", load.c_str(), variant.name, options.seconds);
        const Train train = variant.run(from_seconds(options.seconds), phase);
        if (interrupted()) return false;
        if (!train.failure.empty()) {
            std::fprintf(stderr, "%s: %s\n", variant.name, train.failure.c_str());
            return false;
        }
        phase = phase_of(train);
        pools[{variant.name, load}].add(train);
        if (!train.guarantee.is_discarded() && !train.guarantee.is_null())
            guarantee[variant.name] = train.guarantee;
    }
    return true;
}

/// The bounds that the project sets itself; a remark each, with the figure.
std::vector<std::string> verdicts(const Report& report) {
    std::map<std::pair<std::string, std::string>, const Json*> at;
    for (const Json& each : report.results) at[{each["variant"], each["load"]}] = &each;
    std::vector<std::string> lines;
    for (const char* load : {"idle", "submission"}) {
        if (!at.contains({"listing2", load})) continue;
        const double listing2 = (*at[{"listing2", load}])["mean_hz"];
        const double absolute = (*at[{"absolute", load}])["mean_hz"];
        const double tail = (*at[{"absolute", load}])["interval_ns_p999"].get<double>() /
                            (*at[{"floor", load}])["interval_ns_p999"].get<double>();
        lines.push_back(verdict(listing2 >= 9980,
                                "%s: Listing 2 runs at %.1f Hz; at least 9980 (a bare relative spin: %.1f)",
                                load, listing2, (*at[{"floor_relative", load}])["mean_hz"].get<double>()));
        lines.push_back(verdict(std::abs(absolute - 10'000) <= 0.2,
                                "%s: absolute runs at %.3f Hz; 10000 within 0.2", load, absolute));
        lines.push_back(verdict(tail <= 1.15,
                                "%s: absolute's 99.9 %% interval is %.3f of the floor's; at most 1.15", load,
                                tail));
    }
    if (at.contains({"listing2", "idle"}) && at.contains({"listing2", "submission"})) {
        const double idle = (*at[{"listing2", "idle"}])["mean_hz"];
        const double loaded = (*at[{"listing2", "submission"}])["mean_hz"];
        lines.push_back(verdict(std::abs(loaded / idle - 1) <= 0.0005,
                                "Listing 2 under load against idle: %.5f; within 0.0005 of 1",
                                loaded / idle));
    }
    return lines;
}

/// Everything that the board could not get, each item once.
void add_shortfalls(Report& report) {
    for (const auto& [variant, guarantee] : report.guarantee.items()) {
        for (const char* list : {"loops", "cores"}) {
            for (const Json& each : guarantee.value(list, Json::array())) {
                const std::string text = each.value(std::string{list} == "loops" ? "shortfall" : "note", "");
                if (!text.empty()) report.remarks.push_back("  not had   " + variant + ": " + text);
            }
        }
    }
}

int run(const Options& options) {
    Report report;
    report.guarantee = Json::object();
    Pools pools;
    const bool played = under_each_load(options, report, [&](const std::string& load) {
        for (int round = 0; round < options.rounds; ++round) {
            if (!play_round(options, load, pools, report.guarantee)) return false;
        }
        for (const Variant& variant : kVariants)
            report.results.push_back(row(variant.name, load, pools[{variant.name, load}]));
        return true;
    });
    if (!played) return 1;
    for (std::string& line : verdicts(report)) report.remarks.push_back(std::move(line));
    add_shortfalls(report);
    print(report, options.json);
    return 0;
}

}  // namespace
}  // namespace qduino::bench

int main(int argc, char** argv) {
    using namespace qduino::bench;
    return run_benchmark(
        argc, argv, {},
        {.description = "A 10 kHz pulse train: the paper's Listing 1 and 2, an absolute-deadline variant, "
                        "and a bare spin.",
         .footer = "As root the train has a core of its own; as an ordinary user it runs too, and says what "
                   "it could not have.\nThe computer is restored after every run. Example: "
                   "bench-pulse-train --json > pulse_train.json",
         .has_load = true},
        run);
}
