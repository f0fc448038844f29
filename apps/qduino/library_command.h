// `qduino lib`: installs, lists, removes and looks for Arduino libraries.
#pragma once

#include "apps/qduino/arguments.h"
#include "apps/qduino/sdk.h"
#include "base/result.h"

namespace qduino::apps {

/// Carries out `arguments.action` on `arguments.words`. Returns the exit status. Error: it was not
/// done, and nothing is changed.
[[nodiscard]] Result<int> library_command(const Arguments& arguments, const Sdk& sdk);

}  // namespace qduino::apps
