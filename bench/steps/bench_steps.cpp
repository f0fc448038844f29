// bench-steps: the highest rate of steps that the printer's stepper loop sustains on a core of its
// own, for 1, 3 and 4 axes together.
//
//   bench-steps [--json] [--seconds S] [--rounds N]
//
// Its floor is the same player at 100 000 steps/s in the same run, where it has time for
// everything: what is late there is the computer's. A rate is sustained when p99.99 of the lateness
// is at most 5 µs more than the floor's, and the time line was stretched by at most 3 % more than
// the floor's: each time that a host takes the core away moves it. The median trial of several
// rounds counts.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>

#include "base/text.h"
#include "bench/rig/child.h"
#include "bench/rig/options.h"
#include "bench/steps/step_trials.h"

namespace qduino::bench {
namespace {

constexpr double kFloorHz = 100'000, kFirstHz = 500'000, kLastHz = 8e6, kFactor = 1.4;
constexpr int kFloors = 3;  // trials of the floor in each round
constexpr std::int64_t kMoreNs = 5'000;
constexpr double kStretch = 0.03;
/// What the project asks of three axes.
constexpr double kWantedHz = 2e6;

std::vector<double> ladder() {
    std::vector<double> rates(kFloors, kFloorHz);
    for (double rate = kFirstHz; rate <= kLastHz; rate *= kFactor) rates.push_back(std::round(rate));
    return rates;
}

/// All trials of one count of axes, by rate.
using Trials = std::map<double, std::vector<StepTrial>>;

/// The one in the middle by p99.99.
StepTrial median(std::vector<StepTrial> trials) {
    const auto middle = trials.begin() + static_cast<std::ptrdiff_t>(trials.size() / 2);
    std::ranges::nth_element(trials, middle, {}, &StepTrial::lateness_ns_p9999);
    return *middle;
}

/// The rate that was played, as a share of the one that was asked for.
double share_played(const StepTrial& trial) { return trial.played_hz / trial.asked_hz; }

bool is_sustained(const StepTrial& trial, const StepTrial& floor) {
    return trial.lateness_ns_p9999 <= floor.lateness_ns_p9999 + kMoreNs &&
           share_played(trial) >= share_played(floor) - kStretch;
}

Json row(int axes, const StepTrial& trial, const StepTrial& floor) {
    return {{"axes", axes},
            {"asked_hz", trial.asked_hz},
            {"played_hz", trial.played_hz},
            {"lateness_ns_p50", trial.lateness_ns_p50},
            {"lateness_ns_p99", trial.lateness_ns_p99},
            {"lateness_ns_p9999", trial.lateness_ns_p9999},
            {"lateness_ns_max", trial.lateness_ns_max},
            {"late_steps", trial.late_steps},
            {"sustained", is_sustained(trial, floor)}};
}

/// Adds the rows of `trials`, and the highest sustained rate as a remark.
void add_rows(Report& report, int axes, const Trials& trials) {
    const StepTrial floor = median(trials.at(kFloorHz));
    double highest = 0;
    for (const auto& [asked_hz, of_rate] : trials) {
        const StepTrial trial = median(of_rate);
        report.results.push_back(row(axes, trial, floor));
        if (is_sustained(trial, floor)) highest = asked_hz;
    }
    report.remarks.push_back(
        axes == 3 ? verdict(highest >= kWantedHz, "3 axes: %.0f steps/s are sustained; at least %.0f",
                            highest, kWantedHz)
                  : text<std::string>("  ", axes, " axes: ", Fixed{highest, 0}, " steps/s are sustained"));
}

/// Plays all rates once. False: interrupted.
bool play(const Options& options, int axes, Report& report, Trials& trials) {
    const std::vector<double> rates = ladder();
    const Nanoseconds each = from_seconds(options.seconds) / static_cast<std::int64_t>(rates.size());
    const StepTrials played = run_step_trials(axes, rates, each);
    if (interrupted()) return false;
    for (const StepTrial& trial : played.trials) trials[trial.asked_hz].push_back(trial);
    const std::string who = text<std::string>(axes, " axes");
    if (!played.failure.empty()) report.add_failure(who, played.failure);
    if (played.missing_edges != 0)
        report.remarks.push_back(
            text<std::string>("  ", who, ": ", played.missing_edges,
                              " edges found their ring full: this process was too slow"));
    if (played.guarantee.is_object()) report.guarantee = played.guarantee;
    return true;
}

int run(const Options& options) {
    Report report;
    for (const int axes : {1, 3, 4}) {
        Trials trials;
        for (int round = 0; round < options.rounds; ++round) {
            std::fprintf(stderr, "%d axes, %d of %d …\n", axes, round + 1, options.rounds);
            if (!play(options, axes, report, trials)) return 1;
        }
        if (trials.contains(kFloorHz)) add_rows(report, axes, trials);
    }
    print(report, options.json);
    return report.results.empty() ? 1 : 0;
}

}  // namespace
}  // namespace qduino::bench

int main(int argc, char** argv) {
    using namespace qduino::bench;
    return run_benchmark(
        argc, argv, {.seconds = 4, .rounds = 3},
        {.description =
             "The highest rate of steps that the stepper loop sustains on a core of its own, on 1, 3 and 4 "
             "axes.",
         .footer = "As root the loop has a core of its own. Example: bench-steps --json > steps.json"},
        run);
}
