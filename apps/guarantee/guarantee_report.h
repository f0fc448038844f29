// The guarantee report for people (text, 80 columns) and for programs (JSON).
#pragma once

#include <string>

#include "base/result.h"
#include "board/guarantee.h"

namespace qduino::apps {

/// For each loop, what is enforced and what is not, with the reason and the fix on the next line.
std::string guarantee_text(const board::GuaranteeReport& report);

/// {"board":…,"simulated":…,"memory_locked":…,"loops":[{"id","core","budget_us","period_us",
/// "priority_enforced","budget_enforced","core_owned","shortfall"}…],"cores":[{"core",
/// "interrupts_per_second","worst_gap_us","counted_per_second","counted_us","tick_stopped",
/// "throttling_lifted","note"}…]}; `counted…`: the interrupts that admission counts. A value that
/// was not measured is null.
std::string guarantee_json(const board::GuaranteeReport& report);

/// Writes the JSON to `path`, whole or not at all: a reader meanwhile gets the old file. Error: it
/// cannot be written there.
Result<void> write_guarantee(const board::GuaranteeReport& report, const std::string& path);

}  // namespace qduino::apps
