// `qduino ide`: makes this board one of the Arduino IDE's, and carries out its recipes.
#pragma once

#include "base/result.h"
#include "qduino/arguments.h"
#include "qduino/common/sdk.h"

namespace qduino::apps {

/// Carries out `arguments.action`: "install", "remove", or a recipe (ide_recipe.h) on
/// `arguments.program`. Returns the exit status.
[[nodiscard]] Result<int> ide_command(const Arguments& arguments, const Sdk& sdk);

}  // namespace qduino::apps
