// Where the marks of a time axis stand: at multiples of 1, 2 or 5 times a power of ten.
#pragma once

#include <string>
#include <vector>

#include "base/time.h"

namespace qduino::apps::picture {

/// The step between marks, so that `length` has at most `most` of them, its ends included.
/// Contract: length > 0, most >= 2.
[[nodiscard]] Nanoseconds tick_step(Nanoseconds length, int most);

/// The multiples of `step` in [from, until].
[[nodiscard]] std::vector<Instant> ticks(Instant from, Instant until, Nanoseconds step);

/// The mark's label: "0", "150 ms", "1.5 s", all in the unit that suits `step`.
[[nodiscard]] std::string tick_label(Instant at, Nanoseconds step);

}  // namespace qduino::apps::picture
