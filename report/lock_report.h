// What admission assumes of a sketch's locks, and what came of it while the sketch ran.
#pragma once

#include <string>
#include <vector>

#include "runtime/runtime.h"

namespace qduino::apps {

/// The locks of which nobody said who holds them, and for how long they count; whether R is unknown
/// if they are shared otherwise. Empty: there is nothing to say. After admission.
[[nodiscard]] std::string lock_assumptions(const runtime::Runtime& runtime,
                                           const runtime::SketchTable& table);

/// The same in a few words, to follow "is admitted": "; R is unknown if SPI is shared"; or nothing.
[[nodiscard]] std::string lock_condition(const runtime::Runtime& runtime, const runtime::SketchTable& table);

/// The names of those of which R depends on who shares them, for a program.
[[nodiscard]] std::vector<std::string> locks_that_say_nothing(const runtime::Runtime& runtime,
                                                              const runtime::SketchTable& table);

/// A line for each lock that was taken by a VCPU that heldBy() does not name, shared otherwise than
/// assumed, or held for longer than counted; or nothing. When the loops have ended.
[[nodiscard]] std::string lock_notes(const runtime::Runtime& runtime, const runtime::SketchTable& table);

/// The same in a few words, to follow those of periods_kept(): "; R is unknown: SPI not as
/// declared"; or nothing.
[[nodiscard]] std::string lock_verdict(const runtime::Runtime& runtime, const runtime::SketchTable& table);

/// How long each lock was held by whom, with the heldBy() that would say so; `margin` is added.
/// Empty: nothing was measured.
[[nodiscard]] std::string lock_lengths(double margin);

}  // namespace qduino::apps
