// The twin that fits a machine file: the same numbers, given to the side that plays the metal.
//
// Only a composition root does this: the twin itself never sees the printer's configuration
// (twin/machine.h).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "printer/machine_config.h"
#include "twin/fault.h"
#include "twin/machine.h"

namespace qduino::apps {

/// A twin with the machine's wiring, scales and travel. At power-on it stands where the file
/// expects it (expected_from_switch_mm). Numbers that a machine file does not have (the motors'
/// torque) keep the reference machine's value. Motors are never weaker than the file's speeds.
twin::Machine twin_machine(const printer::MachineConfig& config);

/// The twin that an app is to have. `twin_path`: a machine file of the twin's own, with the keys of
/// docs/machine.md; where it differs from the printer's, the print shows it. Empty: the reference
/// machine in the twin's own numbers, if the printer has no machine file (`machine_path`) either;
/// else the one that fits `config`. Error: as read_machine_file().
[[nodiscard]] Result<twin::Machine> read_twin_machine(const std::filesystem::path& twin_path,
                                                      const std::filesystem::path& machine_path,
                                                      const printer::MachineConfig& config);

/// The faults of a command line (twin/fault.h). Error: that of the first that is none.
Result<std::vector<twin::Fault>> parse_faults(const std::vector<std::string>& words);

}  // namespace qduino::apps
