// The report of printer-sim, as one JSON object: what was asked, what was built, and how well it
// was timed.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "printer/link/layout.h"
#include "twin/report.h"

namespace qduino::apps {

struct PrintResult {
    bool job_completed = false;  ///< by the sketch's own word
    std::string error;           ///< why not
    double print_time_s = 0;     ///< virtual, from the job's beginning to its end
    double wall_s = 0;
    twin::Report built;
    printer::link::MotionStatus motion;
    std::vector<std::string> unknown_codes;
    std::vector<std::string> warnings;

    /// The built part is the one that was asked for, and the job ran to its end.
    [[nodiscard]] bool success() const { return job_completed && built.matches; }
};

/// Keys as docs/printer-sim.md lists them.
nlohmann::ordered_json to_json(const PrintResult& result);

/// A few lines for a person, at most 80 columns wide.
std::string summary(const PrintResult& result);

}  // namespace qduino::apps
