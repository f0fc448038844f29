// Admission's verdict on a sketch, for people (text, 80 columns) and for programs (JSON): `qduino
// check`.
#pragma once

#include <string>
#include <vector>

#include "runtime/plan.h"

namespace qduino::apps {

/// The board that the sketch was checked against.
struct CheckedBoard {
    std::string sketch;      ///< its name
    std::string board_file;  ///< empty: none
    int cores = 1;
    bool setup_ran = false;  ///< and has
    /// Locks that make R unknown if they are shared otherwise than assumed (lock_report.h).
    std::vector<std::string> locks_that_say_nothing{};
};

/// Every loop and every I/O VCPU has been admitted.
[[nodiscard]] bool all_admitted(const runtime::Plan& plan);

/// The table of loops, the verdict on each core, each refusal with its remedy, and the overheads
/// that were counted.
[[nodiscard]] std::string admission_text(const runtime::Plan& plan, const runtime::SketchTable& table,
                                         const CheckedBoard& board);

/// One sentence: the sketch is admitted, with the condition (lock_report.h), or who stands in the
/// way.
[[nodiscard]] std::string admission_verdict(const runtime::Plan& plan, const CheckedBoard& board,
                                            const std::string& condition);

/// The same as JSON: {"sketch","admitted","board":{…},"setup_ran","loops":[…],"io":[…],"cores":[…],
/// "overheads":[…],"locks_that_say_nothing":[…],"refusals":[…],"explanation"}. Durations are whole
/// nanoseconds (docs/qduino.md lists every key).
[[nodiscard]] std::string admission_json(const runtime::Plan& plan, const runtime::SketchTable& table,
                                         const CheckedBoard& board);

}  // namespace qduino::apps
