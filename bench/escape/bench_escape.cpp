// bench-escape: what does a loop get that does not want to keep to its budget? Each pattern with
// its warden and without, judged from outside.
//
//   bench-escape [--json] [--seconds S] [--rounds N]
//
// As root, or with a right to real-time priorities. Nothing is lifted: where a loop escapes, the
// kernel's own throttling keeps 5 % of its core for others.
#include <algorithm>
#include <cstdio>

#include "bench/escape/judge.h"
#include "bench/escape/patterns.h"
#include "bench/rig/child.h"
#include "bench/rig/options.h"

namespace qduino::bench {
namespace {

/// What the project promises: C/T and 2 % of the core more.
constexpr double kMargin = 0.02;

std::string escape_in(const std::string& report) {
    const Json told = Json::parse(report, nullptr, false);
    if (!told.is_object()) return "no report";
    return told["loops"][0]["escape"].get<std::string>();
}

int run(const Options& options) {
    Report report;
    const std::string program = program_beside("escape-patterns");
    double most = 0, cost = 0;
    for (const EscapePattern& pattern : escape_patterns()) {
        std::fprintf(stderr, "%s …\n", pattern.name);
        double with = 0, without = 0, warden = 0;
        std::string escape;
        for (int round = 0; round < options.rounds; ++round) {
            const EscapeRun kept = run_escape(program, pattern.name, from_seconds(options.seconds), true);
            const EscapeRun loose = run_escape(program, pattern.name, from_seconds(options.seconds), false);
            for (const EscapeRun& done : {kept, loose}) {
                if (!done.trouble.empty()) report.add_failure(pattern.name, done.trouble);
            }
            with = std::max(with, kept.share);
            without = std::max(without, loose.share);
            warden = std::max(warden, kept.warden_share);
            escape = escape_in(kept.report);
        }
        most = std::max(most, with);
        cost = std::max(cost, warden);
        report.results.push_back({{"pattern", pattern.name},
                                  {"asked", kEscapeeShare},
                                  {"with_warden", with},
                                  {"without", without},
                                  {"warden", warden},
                                  {"report", escape.empty() ? "kept" : escape}});
    }
    report.remarks.push_back(verdict(most <= kEscapeeShare + kMargin,
                                     "the most that any pattern got is %.4f of the core, at most %.4f", most,
                                     kEscapeeShare + kMargin));
    report.remarks.push_back(verdict(cost <= kMargin, "the warden took %.4f of a core at most", cost));
    print(report, options.json);
    return 0;
}

}  // namespace
}  // namespace qduino::bench

int main(int argc, char** argv) {
    using namespace qduino::bench;
    return run_benchmark(argc, argv, {.seconds = 5, .rounds = 1},
                         {.description = "Loops that try to take more than their budgets: what they get.",
                          .footer = "Example: bench-escape --json > escape.json"},
                         run);
}
