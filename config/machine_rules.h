// The rules between a machine's numbers. Each number may be right, and the machine impossible: two
// pins that are one, a heater too weak for its highest target, a sensor that ends below it.
#pragma once

#include <optional>
#include <string>

#include "printer/machine_config.h"

namespace qduino::apps {

struct BrokenRule {
    std::string path;  ///< of the key to change: "axes.x.minimum_mm"
    std::string what;  ///< what is wrong, and what would be right
};

/// The first rule that `machine` breaks; nothing: none.
[[nodiscard]] std::optional<BrokenRule> broken_rule(const printer::MachineConfig& machine);

}  // namespace qduino::apps
