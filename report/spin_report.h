// What the end of a simulated run says of code that spins (board/sim/spin_watch.h).
#pragma once

#include <string>
#include <vector>

#include "board/sim/spin.h"

namespace qduino::apps {

/// For the verdict: "loop 1 spins at blink.ino:12, since 0.5 s; " for each that has not ended; or
/// nothing.
[[nodiscard]] std::string spin_verdict(const std::vector<board::sim::SpinSeen>& spins);

/// A line for each that has ended: what it took, where, and what would change that; or nothing.
[[nodiscard]] std::string spin_notes(const std::vector<board::sim::SpinSeen>& spins);

/// The same for a sketch whose setup() has not ended: where it was seen to spin, if it was.
[[nodiscard]] std::string setup_verdict(const std::vector<board::sim::SpinSeen>& spins, Nanoseconds after);

}  // namespace qduino::apps
