// The error of a system call as a project Error: what was attempted, on what, and the kernel's
// words.
#pragma once

#include <cerrno>
#include <string_view>

#include "base/result.h"

namespace qduino::posix {

/// "cannot WHAT OBJECT: REASON". `what` reads as an attempt ("open"), `object` names the file. Call
/// it at once after the failure: it reads errno by default. The code is internal for an errno that
/// no caller decides by.
[[nodiscard]] Error system_error(std::string_view what, std::string_view object, int error = errno);

}  // namespace qduino::posix
