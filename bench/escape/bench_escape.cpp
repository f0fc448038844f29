// bench-escape: what does a loop get that does not want to keep to its budget? Each pattern with
// its warden and without, judged from outside.
//
//   bench-escape [--json] [--seconds S] [--rounds N] [--only PART]
//
// As root, or with a right to real-time priorities. Nothing is lifted:
// where a loop escapes, the kernel's own throttling keeps 5 % of its core for others.
#include <algorithm>
#include <cstdio>
#include <vector>

#include "bench/escape/judge.h"
#include "bench/escape/patterns.h"
#include "bench/rig/child.h"
#include "bench/rig/options.h"
#include "board/linux/kernel/clock.h"

namespace qduino::bench {
namespace {

/// What the project promises: C/T and 2 % of the core more.
constexpr double kMargin = 0.02;

/// A run without its warden only shows that the pattern does take more.
constexpr Nanoseconds kLooseRun = 400ms;
/// R of the loop above, at 0.4 ms in 4 ms: its period, for it is admitted.
constexpr Nanoseconds kBystanderBound = 4ms;

/// What the report says of the loop, of the watch, and of who ran in front of loops.
std::string said_in(const std::string& report) {
    const Json told = Json::parse(report, nullptr, false);
    if (!told.is_object()) return "no report";
    std::string said;
    for (const std::string& each :
         {told["loops"][0]["escape"].get<std::string>(), told["loops"][0]["taken"].get<std::string>(),
          told["watch_lost"].get<std::string>(), told["intruders"].get<std::string>()}) {
        if (!each.empty()) said += (said.empty() ? "" : "; ") + each;
    }
    return said;
}

/// The cause that the report has for the worst delay of the loop above; empty: it was not late.
std::string cause_of_delay(const std::string& report) {
    const Json told = Json::parse(report, nullptr, false);
    if (!told.is_object()) return "";
    for (const Json& delay : told["delays"]) {
        if (delay["id"] == 3) return delay["cause"].get<std::string>();
    }
    return "";
}

/// What was charged to the loop, what its priority was lent for included. A holder of its lock, or
/// a thread of setup()'s, is an ordinary thread otherwise, and uses what nobody wants.
double charged_in(const std::string& report) {
    const Json told = Json::parse(report, nullptr, false);
    if (!told.is_object() || !told["loops"][0]["cpu_used_us"].is_number()) return 1;
    return told["loops"][0]["cpu_used_us"].get<double>() / told["loops"][0]["watched_us"].get<double>();
}

struct Outcome {
    double with = 0, cost = 0, ordinary = 0;
    Nanoseconds bystander{-1};
    std::string said, cause;
};

Outcome judge_watched(const std::string& program, const EscapePattern& pattern, const Options& options,
                      Report& report) {
    Outcome outcome;
    for (int round = 0; round < options.rounds; ++round) {
        const EscapeRun kept = run_escape(program, pattern.name, from_seconds(options.seconds), true);
        if (!kept.trouble.empty()) report.add_failure(pattern.name, kept.trouble);
        const bool charged = pattern.lends || (pattern.ordinary && !kept.saw_ranked);
        outcome.with = std::max(outcome.with, charged ? charged_in(kept.report) : kept.share);
        outcome.ordinary = std::max(outcome.ordinary, charged ? kept.share : 0);
        outcome.cost = std::max(outcome.cost, kept.warden_share);
        outcome.bystander = std::max(outcome.bystander, kept.bystander);
        outcome.said = said_in(kept.report);
        outcome.cause = cause_of_delay(kept.report);
    }
    return outcome;
}

int run(const Options& options) {
    Report report;
    const std::string program = program_beside("escape-patterns");
    double most = 0, cost = 0;
    int nameless = 0;
    for (const EscapePattern& pattern : escape_patterns()) {
        if (std::string_view{pattern.name}.find(options.only) == std::string_view::npos) continue;
        std::fprintf(stderr, "%s …\n", pattern.name);
        const Outcome outcome = judge_watched(program, pattern, options, report);
        most = std::max(most, outcome.with);
        cost = std::max(cost, outcome.cost);
        if (outcome.bystander > kBystanderBound && outcome.said.empty() && outcome.cause.empty()) ++nameless;
        report.results.push_back({{"pattern", pattern.name},
                                  {"asked", kEscapeeShare},
                                  {"with_warden", outcome.with},
                                  {"ordinary", outcome.ordinary},
                                  {"without", run_escape(program, pattern.name, kLooseRun, false).share},
                                  {"warden", outcome.cost},
                                  {"bystander_us", static_cast<double>(outcome.bystander / 1us)},
                                  {"bystander_late_by", outcome.cause},
                                  {"report", outcome.said.empty() ? "kept" : outcome.said}});
    }
    report.remarks.push_back(verdict(most <= kEscapeeShare + kMargin,
                                     "the most that any pattern got is %.4f of the core, at most %.4f", most,
                                     kEscapeeShare + kMargin));
    report.remarks.push_back(verdict(cost <= kMargin, "the warden took %.4f of a core at most", cost));
    report.remarks.push_back(
        verdict(nameless == 0, "the loop above was late %d times without a name for it", nameless));
    print(report, options.json);
    return 0;
}

}  // namespace
}  // namespace qduino::bench

int main(int argc, char** argv) {
    using namespace qduino::bench;
    return run_benchmark(argc, argv, {.seconds = 2, .rounds = 1},
                         {.description = "Loops that try to take more than their budgets: what they get.",
                          .footer = "Example: bench-escape --json > escape.json",
                          .has_parts = true},
                         run);
}
