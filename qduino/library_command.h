// `qduino lib`: installs, lists, removes and looks for Arduino libraries.
#pragma once

#include "base/result.h"
#include "qduino/arguments.h"
#include "qduino/common/sdk.h"

namespace qduino::apps {

/// Carries out `arguments.action` on `arguments.words`. Returns the exit status. Error: it was not
/// done, and nothing is changed.
[[nodiscard]] Result<int> library_command(const Arguments& arguments, const Sdk& sdk);

}  // namespace qduino::apps
