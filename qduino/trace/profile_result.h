// What `qduino profile` makes of a profile that the sketch's program has written: the change of the
// sketch's text, shown, and written where that is asked for.
#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "qduino/build/sketch_edit.h"

namespace qduino::apps {

/// The loops for which the profile (JSON) suggests something. Error: it is no profile.
[[nodiscard]] Result<std::vector<BudgetEdit>> suggested_edits(const std::string& profile);

/// Prints the change to standard output, and writes it into the tabs where `write` is true. Returns
/// the exit status: 1 when `write` is true and a declaration cannot be changed. Error: a tab cannot
/// be written.
Result<int> apply_profile(const std::string& profile, const std::vector<TabText>& tabs, bool write);

}  // namespace qduino::apps
