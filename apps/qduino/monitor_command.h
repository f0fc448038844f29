// `qduino monitor`: Serial of an uploaded sketch in this terminal, or as curves in a browser.
#pragma once

#include "apps/qduino/arguments.h"
#include "base/result.h"

namespace qduino::apps {

/// Until the sketch ends or Ctrl-C. Returns the exit status. Error: no sketch runs there.
[[nodiscard]] Result<int> monitor_command(const Arguments& arguments);

}  // namespace qduino::apps
