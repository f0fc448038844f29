// What is wrong with the macros and the start of a machine file, before a job needs one.
#pragma once

#include <string>

#include "printer/machine_config.h"

namespace qduino::apps {

/// One line for each line of a macro, or of [start], that no job could carry out, whatever it
/// gives: it is malformed, or its code is none of this printer's, or a macro calls a macro. Empty
/// when there is none. A parameter counts as a number; [start] has HOT_END and BED alone.
[[nodiscard]] std::string macro_errors(const printer::MachineConfig& machine);

}  // namespace qduino::apps
