// What is wrong with the macros of a machine file, before a job calls one.
#pragma once

#include <string>

#include "printer/machine_config.h"

namespace qduino::apps {

/// One line for each line of a macro that no job could carry out, whatever it gives: it is
/// malformed, or its code is none of this printer's, or it calls a macro. Empty when there is none.
/// A parameter counts as a number.
[[nodiscard]] std::string macro_errors(const printer::MachineConfig& machine);

}  // namespace qduino::apps
