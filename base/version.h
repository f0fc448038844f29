// The version of the whole: as the build was told (CMakeLists.txt), and nowhere else.
#pragma once

#include <string_view>

namespace qduino {

/// "0.1.0".
[[nodiscard]] std::string_view version();

}  // namespace qduino
