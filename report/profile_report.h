// What a profiled run found, and the budgets and periods that follow from it: `qduino profile`.
//
//   C   worst observed · (1 + margin), rounded up to two digits, 100 us at least
//   T   as declared; unless C is longer, or half of all releases last longer than T: then the
//       length that 99 % of them keep · (1 + margin), rounded up (not where a budget that was
//       enforced and too short has made them long)
//
// For a handler with an I/O VCPU of its own, C follows by the same rule from the CPU time of its
// busiest stretch of one T. T stays as declared.
//
// What was not observed may take longer: a profile is no proof, and the margin is the user's.
#pragma once

#include <optional>
#include <string>

#include "runtime/runtime.h"

namespace qduino::apps {

struct ProfiledRun {
    std::string sketch;   ///< its name
    double margin = 0.2;  ///< on top of the worst observed
    Instant end;          ///< of the run, on the board's clock
};

struct Suggestion {
    Nanoseconds budget{};
    Nanoseconds period{};
    std::string why_not;  ///< not empty: none can be made

    [[nodiscard]] bool made() const { return why_not.empty(); }
};

/// The next value of two digits: 170 us for 161.2 us.
[[nodiscard]] Nanoseconds rounded_up(Nanoseconds value);

/// The suggestion for a loop that was profiled and has ended.
[[nodiscard]] Suggestion suggestion_for(const runtime::Loop& loop, double margin);

/// The suggestion for the handler of `pin`, which has a profile.
[[nodiscard]] Suggestion suggestion_for(const runtime::Runtime& runtime, board::PinId pin, double margin);

/// A table of loops and handlers, the worst executions with their causes, the suggestions, and
/// whether they would be admitted. Call it when the loops have ended.
[[nodiscard]] std::string profile_text(const runtime::Runtime& runtime, const ProfiledRun& run);

/// The same as JSON (docs/qduino.md lists every key). Durations are whole nanoseconds.
[[nodiscard]] std::string profile_json(const runtime::Runtime& runtime, const ProfiledRun& run);

}  // namespace qduino::apps
