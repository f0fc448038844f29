#include "bench/rig/options.h"

#include <CLI/CLI.hpp>
#include <cstdio>

#include "bench/rig/load.h"

namespace qduino::bench {

int run_benchmark(int argc, char** argv, Options defaults, const About& about,
                  const std::function<int(const Options&)>& run) {
    CLI::App app(about.description);
    app.footer(about.footer);
    app.add_flag("--json", defaults.json, "Print one JSON object");
    app.add_option("--seconds", defaults.seconds, "Length of each run")
        ->check(CLI::Range(0.5, 20.0))
        ->capture_default_str();
    app.add_option("--rounds", defaults.rounds, "Runs of each, in turn")
        ->check(CLI::Range(1, 100))
        ->capture_default_str();
    if (about.has_load) {
        app.add_option("--load", defaults.load, "What else the computer does")
            ->check(CLI::IsMember({"idle", "submission", "both"}))
            ->capture_default_str();
    }
    CLI11_PARSE(app, argc, argv);
    return run(defaults);
}

bool under_each_load(const Options& options, Report& report,
                     const std::function<bool(const std::string& load)>& play) {
    for (const std::string load : {"idle", "submission"}) {
        if (options.load != "both" && options.load != load) continue;
        SubmissionLoad submission;
        if (load == "submission") {
            if (const std::string failure = submission.start(); !failure.empty()) {
                std::fprintf(stderr, "submission load: %s\n", failure.c_str());
                return false;
            }
        }
        if (!play(load)) return false;
        if (load != "submission") continue;
        submission.stop();
        report.remarks.push_back("  load      " + std::to_string(submission.uploads()) + " uploads, " +
                                 std::to_string(static_cast<int>(submission.megabytes())) + " MB");
    }
    return true;
}

}  // namespace qduino::bench
