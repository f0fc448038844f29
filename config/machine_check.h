// What a machine file says, in the words of a person who checks it: `printer check FILE`.
#pragma once

#include <string>
#include <string_view>

#include "printer/machine_config.h"

namespace qduino::apps {

/// Some lines, at most 100 columns wide: bounds, speeds, sensors, heating times by the model.
[[nodiscard]] std::string describe(const printer::MachineConfig& machine, std::string_view file);

}  // namespace qduino::apps
