// The command line that the timing benchmarks share, and the loads that it asks for.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "bench/rig/report.h"

namespace qduino::bench {

struct Options {
    bool json = false;
    double seconds = 2;  ///< of each run
    int rounds = 8;      ///< runs of each contender, in turn: a host's noise comes and goes within seconds
    std::string load = "both";  ///< idle, submission or both
};

/// Fills in `options`. A value: leave with it (help was printed, or the line is wrong and that was said).
std::optional<int> parse_options(Options& options, int argc, char** argv, const std::string& description,
                                 const std::string& footer, bool has_load);

/// Calls `play` once without load and once under the submission load (load.h), as asked. False: `play` was false, or there was no load to
/// be had; that was said. What was sent is remarked in `report`.
bool under_each_load(const Options& options, Report& report,
                     const std::function<bool(const std::string& load)>& play);

}  // namespace qduino::bench
