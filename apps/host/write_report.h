// The guarantee report as a file.
#pragma once

#include <string>

#include "base/result.h"
#include "board/guarantee.h"

namespace qduino::apps {

/// Writes `report` to `path` as JSON (guarantee_report.h), whole or not at all: a reader meanwhile
/// gets the old file. Error: it cannot be written there.
Result<void> write_guarantee(const board::GuaranteeReport& report, const std::string& path);

}  // namespace qduino::apps
