// The command line that the timing benchmarks share, and the loads that it asks for.
#pragma once

#include <functional>
#include <string>

#include "bench/rig/report.h"

namespace qduino::bench {

struct Options {
    bool json = false;
    double seconds = 2;  ///< of each run
    /// Runs of each contender, in turn: a host's noise comes and goes within seconds.
    int rounds = 8;
    std::string load = "both";  ///< idle, submission or both
    /// Only those parts of a benchmark run that have this in their names; empty: all.
    std::string only = {};
};

/// What a benchmark says of itself on --help.
struct About {
    std::string description;
    std::string footer;
    bool has_load = false;   ///< it takes --load
    bool has_parts = false;  ///< it takes --only
};

/// main() of a benchmark: `run` gets `defaults` as the command line changes them. Returns the exit
/// status: that of `run`, or help was printed, or the line was wrong and the user was told.
int run_benchmark(int argc, char** argv, Options defaults, const About& about,
                  const std::function<int(const Options&)>& run);

/// Calls `play` once without load and once under the submission load (load.h), as asked. False:
/// `play` was false, or the load could not be started; that was reported. Adds a remark to `report`
/// on the uploads sent.
bool under_each_load(const Options& options, Report& report,
                     const std::function<bool(const std::string& load)>& play);

}  // namespace qduino::bench
