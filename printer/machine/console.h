// The lines that people type and a serial host sends: each is kept until its turn comes, and then
// checked. A code's row says when it may be typed (gcode/command_table.h).
//
// Bounded; no heap. Loop 1 only.
#pragma once

#include <array>
#include <optional>
#include <string_view>

#include "base/fixed_string.h"
#include "base/result.h"
#include "printer/gcode/command.h"
#include "printer/gcode/command_table.h"
#include "printer/gcode/interpreter.h"
#include "printer/link/layout.h"
#include "printer/machine/speaker.h"

namespace qduino::printer::machine {

class Console {
  public:
    /// The most lines of people that wait. A host has room for as many as it may send.
    static constexpr std::size_t kLinesMax = 16;

    /// The facts that decide.
    struct Situation {
        bool faulted = false;
        bool job_runs = false;
        bool head_rests = false;  ///< beside the path of the job that runs
    };
    /// Error: why not now.
    [[nodiscard]] static Result<void> may_type(const gcode::Command& command, const Situation& now);

    /// Keeps a line; an empty one of a host says that the host begins. Error: it is too long, or
    /// too many wait.
    [[nodiscard]] Result<void> take(std::string_view line, Speaker speaker = Speaker::person);
    [[nodiscard]] bool waiting() const { return count_ != 0; }
    /// The next line. Contract: waiting().
    [[nodiscard]] std::string_view line() const { return next().line.view(); }
    /// Whose line is next. Contract: waiting().
    [[nodiscard]] Speaker speaker() const { return next().speaker; }
    /// When a host is told `ok` for the next line. Contract: waiting().
    [[nodiscard]] gcode::Ok ok() const;
    /// The next line is a question; or, where `acts` is set, one that a person might type while a
    /// job prints. It need not wait for what moves. Contract: waiting().
    [[nodiscard]] bool waits_for_nothing(bool acts) const;
    /// The next line changes how the job's lines are read (which objects are left out): it waits
    /// for the end of the line in hand. Contract: waiting().
    [[nodiscard]] bool waits_for_line() const;
    /// The next line is empty and a host's. Contract: waiting().
    [[nodiscard]] bool host_begins() const { return next().speaker == Speaker::host && next().line.empty(); }
    /// Returns how many of the lines were a host's, empty ones left out.
    std::size_t forget();

    /// The oldest line, carried out by `interpreter`. Nothing: it held no command. Contract:
    /// waiting(); and nothing is pending in `interpreter`, or the line does not wait for that.
    std::optional<Result<void>> run_next(const Situation& now, gcode::Interpreter& interpreter);

  private:
    struct Entry {
        FixedString<gcode::kCommandBytesMax> line;
        Speaker speaker = Speaker::person;
    };
    [[nodiscard]] std::optional<gcode::Command> command() const;
    [[nodiscard]] const Entry& next() const {
        QDUINO_EXPECT(waiting());
        return entries_[first_];
    }
    [[nodiscard]] std::size_t held_for(Speaker speaker) const {
        return speaker == Speaker::host ? of_host_ : count_ - of_host_;
    }

    std::array<Entry, kLinesMax + link::kHostLinesMax + 1> entries_{};  // a ring
    std::size_t first_ = 0;
    std::size_t count_ = 0;
    std::size_t of_host_ = 0;
};

}  // namespace qduino::printer::machine
