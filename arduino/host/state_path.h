// Where a sketch keeps what outlives it, when nobody says another place.
#pragma once

#include <string>
#include <string_view>

namespace qduino::arduino::host {

/// What the environment's `variable` names; else the program's name with `ending`, in qduino's
/// folder for state (XDG Base Directory Specification), which exists when this returns, if it can
/// be made.
std::string state_path(const char* variable, std::string_view ending);

}  // namespace qduino::arduino::host
