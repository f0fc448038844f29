// Preflight of uploads: the printer's own parser and interpreter read the file, its facts become
// the job's.
#pragma once

#include <atomic>
#include <cstdint>

#include "printer/machine_config.h"
#include "spool/analyzer.h"

namespace qduino::analysis {

class PreflightAnalyzer final : public spool::Analyzer {
  public:
    explicit PreflightAnalyzer(const printer::MachineConfig& machine)
        : machine_(machine), step_cost_ns_(machine.step_cost.count()) {}

    /// What a step costs, from now on. Any thread.
    void set_step_cost(Nanoseconds cost) { step_cost_ns_.store(cost.count(), std::memory_order_relaxed); }
    [[nodiscard]] Nanoseconds step_cost() const {
        return Nanoseconds{step_cost_ns_.load(std::memory_order_relaxed)};
    }

    std::unique_ptr<spool::FileReading> begin(ByteSink& layers) override;

  private:
    printer::MachineConfig machine_;
    std::atomic<std::int64_t> step_cost_ns_;
};

/// Judges one line of G-code on its own, for errors that no state of the machine could make right
/// (a temperature out of range, say). Error: invalid_argument, out_of_range.
[[nodiscard]] Result<void> check_line(const printer::MachineConfig& machine, std::string_view line);

}  // namespace qduino::analysis
