// Prints one file in virtual time, from its first byte to a report on what was built.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "apps/printer_sim/print_report.h"
#include "base/result.h"
#include "printer/machine_config.h"
#include "twin/fault.h"

namespace qduino::apps {

struct PrintOptions {
    std::string file;
    printer::MachineConfig machine;
    std::string steps_path;  ///< CSV of every step; empty: none
    std::vector<twin::Fault> faults;
    /// Called now and then with the fraction of the file executed and the virtual time in seconds.
    /// May be empty.
    std::function<void(double, double)> progress;
};

/// Error: the file cannot be read or is no G-code, the step file cannot be written, the sketch is
/// refused. Once per process.
Result<PrintResult> print_file(const PrintOptions& options);

}  // namespace qduino::apps
