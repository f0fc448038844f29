// Preflight of uploads: the printer's own parser and interpreter read the file, its facts become
// the job's.
#pragma once

#include "printer/machine_config.h"
#include "spool/analyzer.h"

namespace qduino::printd {

class PreflightAnalyzer final : public spool::Analyzer {
  public:
    explicit PreflightAnalyzer(const printer::MachineConfig& machine) : machine_(machine) {}

    Result<spool::Analysis> analyze(const std::filesystem::path& gcode,
                                    const std::filesystem::path& layers) override;

  private:
    printer::MachineConfig machine_;
};

/// Judges one line of G-code on its own, for errors that no state of the machine could make right
/// (a temperature out of range, say). Error: invalid_argument, out_of_range.
[[nodiscard]] Result<void> check_line(const printer::MachineConfig& machine, std::string_view line);

}  // namespace qduino::printd
