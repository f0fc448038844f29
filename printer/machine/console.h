// The lines that people type: each is kept until its turn comes, and then checked. A code's row
// says when it may be typed (gcode/command_table.h).
//
// Bounded; no heap. Loop 1 only.
#pragma once

#include <optional>
#include <string_view>

#include "base/fixed_string.h"
#include "base/fixed_vector.h"
#include "base/result.h"
#include "printer/gcode/command.h"
#include "printer/gcode/interpreter.h"

namespace qduino::printer::machine {

class Console {
  public:
    static constexpr std::size_t kLinesMax = 16;

    /// The facts that decide.
    struct Situation {
        bool faulted = false;
        bool job_runs = false;
        bool head_rests = false;  ///< beside the path of the job that runs
    };
    /// Error: why not now.
    [[nodiscard]] static Result<void> may_type(const gcode::Command& command, const Situation& now);

    /// Keeps a line. Error: it is too long, or too many wait.
    [[nodiscard]] Result<void> take(std::string_view line);
    [[nodiscard]] bool waiting() const { return !lines_.empty(); }
    void forget() { lines_.clear(); }

    /// The oldest line, carried out by `interpreter`. Nothing: it held no command. Contract:
    /// waiting(), and nothing is pending in `interpreter`.
    std::optional<Result<void>> run_next(const Situation& now, gcode::Interpreter& interpreter);

  private:
    FixedVector<FixedString<gcode::kCommandBytesMax>, kLinesMax> lines_;
};

}  // namespace qduino::printer::machine
