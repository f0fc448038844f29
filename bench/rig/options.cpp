#include "bench/rig/options.h"

#include <cstdio>

#include "bench/rig/load.h"
#include "terminal/command_line.h"

namespace qduino::bench {

int run_benchmark(int argc, char** argv, Options defaults, const About& about,
                  const std::function<int(const Options&)>& run) {
    apps::CommandLine line{about.description, about.footer};
    line.flag("--json", defaults.json, "Print one JSON object");
    line.option("--seconds", defaults.seconds, "Length of each run").within(0.5, 20.0).shows_default();
    line.option("--rounds", defaults.rounds, "Runs of each, in turn").within(1, 100).shows_default();
    if (about.has_parts) line.option("--only", defaults.only, "Those alone that have this in their names");
    if (about.has_load) {
        line.option("--load", defaults.load, "What else the computer does")
            .one_of({"idle", "submission", "both"})
            .shows_default();
    }
    if (const auto status = line.parse(argc, argv)) return *status;
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
