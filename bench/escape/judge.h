// Runs an escape pattern and judges it from outside, by the kernel's account of all processes that
// come from it.
#pragma once

#include <string>

#include "base/time.h"

namespace qduino::bench {

/// C/T of the loop that tries to escape (escapee.cpp).
inline constexpr double kEscapeeShare = 0.1;

struct EscapeRun {
    /// Why there is no result; empty: there is one.
    std::string trouble;
    /// CPU time of the loop that tries to escape and of everything that it started, by the time
    /// that passed. The board's main thread counts with it, the warden and the other loop do not.
    double share = 0;
    double warden_share = 0;  ///< the warden's CPU time by the time that passed
    /// Beside loops, warden and witness some thread was seen at a real-time priority in effect.
    bool saw_ranked = false;
    Nanoseconds bystander{-1};  ///< latest end of a release of the loop above; < 0: unknown
    std::string report;         ///< the guarantee report, JSON; empty: it wrote none
};

/// `program` is escape-patterns. Judges from the beginning of the loops for `length`; at most 10 s
/// later nothing of it is left. The caller has no other children and one thread.
[[nodiscard]] EscapeRun run_escape(const std::string& program, const std::string& pattern, Nanoseconds length,
                                   bool with_warden);

}  // namespace qduino::bench
