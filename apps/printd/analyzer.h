// Preflight of uploads: the printer's own parser and interpreter read the file, its facts become the job's.
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

/// Judges one line of G-code on its own: what no machine state could make right (a temperature out of range, say).
/// The interpreter that prints does it, on a machine that does nothing. Error: as the interpreter's.
[[nodiscard]] Result<void> check_line(const printer::MachineConfig& machine, std::string_view line);

}  // namespace qduino::printd
