// The twin that fits a machine file: the same numbers, given to the one who plays the metal.
//
// Only a composition root does this: the twin itself never sees the printer's configuration (twin/machine.h).
#pragma once

#include "printer/machine_config.h"
#include "twin/machine.h"

namespace qduino::apps {

/// A twin with the machine's wiring, scales and travel. What a machine file does not know (where the carriage stands at
/// power-on, heat capacities, the motors' torque) keeps the reference machine's value; motors are never weaker than the
/// speeds that the file allows.
twin::Machine twin_machine(const printer::MachineConfig& config);

}  // namespace qduino::apps
