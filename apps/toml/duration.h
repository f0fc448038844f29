// Durations as people write them in a file: "4 ms", "90us", "1.5 s".
#pragma once

#include <optional>
#include <string_view>

#include "base/time.h"

namespace qduino::apps {

/// The units that parse_duration() takes, for messages.
inline constexpr std::string_view kDurationUnits = "ns, us, ms, s, min or h";

/// A decimal number, not negative, and its unit; blanks between them are welcome. Nothing when
/// `text` is anything else, is finer than a nanosecond, or is longer than 292 years. Exact: no
/// floating point on the way.
[[nodiscard]] std::optional<Nanoseconds> parse_duration(std::string_view text);

}  // namespace qduino::apps
