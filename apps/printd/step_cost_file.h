// What a step costs on this computer (printer/step/step_cost.h), from the sketch's link to the
// analyzer of jobs, and kept in the state folder: so jobs are judged by it also while no printer
// runs.
#pragma once

#include <filesystem>

#include "analysis/preflight_analyzer.h"
#include "printer/link/layout.h"

namespace qduino::printd {

class StepCostFile {
  public:
    /// Gives `analyzer`, which outlives it, the cost that is on file in `state`, if there is one.
    StepCostFile(const std::filesystem::path& state, analysis::PreflightAnalyzer& analyzer);

    /// Takes what the sketch behind `link` (may be null) has measured. True when that is news: it
    /// is then on file, if it can be.
    bool take(const printer::link::LinkLayout* link);

  private:
    std::filesystem::path path_;
    analysis::PreflightAnalyzer& analyzer_;
};

}  // namespace qduino::printd
