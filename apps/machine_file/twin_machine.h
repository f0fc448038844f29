// The twin that fits a machine file: the same numbers, given to the side that plays the metal.
//
// Only a composition root does this: the twin itself never sees the printer's configuration
// (twin/machine.h).
#pragma once

#include <string>
#include <vector>

#include "printer/machine_config.h"
#include "twin/fault.h"
#include "twin/machine.h"

namespace qduino::apps {

/// A twin with the machine's wiring, scales and travel. Numbers that a machine file does not have
/// (where the carriage stands at power-on, heat capacities, the motors' torque) keep the reference
/// machine's value. Motors are never weaker than the speeds that the file allows.
twin::Machine twin_machine(const printer::MachineConfig& config);

/// The faults of a command line (twin/fault.h). Error: that of the first that is none.
Result<std::vector<twin::Fault>> parse_faults(const std::vector<std::string>& words);

}  // namespace qduino::apps
