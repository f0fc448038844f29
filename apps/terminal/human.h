// Numbers for people: three significant digits, in the unit that keeps them short. Programs get
// exact numbers, in JSON.
#pragma once

#include <string>

#include "base/time.h"

namespace qduino::apps {

/// "734 ns", "12.7 us", "186 ms", "1.01 s", "30 ms". Rounded; for exact ones see
/// text() of base/text.h.
[[nodiscard]] std::string human_duration(Nanoseconds duration);
/// "1 loop", "3 loops".
[[nodiscard]] std::string counted(long long count, const std::string& what);

}  // namespace qduino::apps
