// `qduino monitor`: Serial of an uploaded sketch in this terminal, or as curves in a browser.
#pragma once

#include "base/result.h"
#include "qduino/arguments.h"

namespace qduino::apps {

/// Until the sketch ends or Ctrl-C. Returns the exit status. Error: no sketch runs there.
[[nodiscard]] Result<int> monitor_command(const Arguments& arguments);

}  // namespace qduino::apps
