// Bytes to commands: line reader (line_reader.h) and words (lexer.h) in one object.
//
//   bytes ─► LineReader ─► parse_words ─► Line { command | nothing, comment, error }
//
// Two ways to use it. Pull, when the consumer must be able to stop between lines (a planner that is
// full, a wait for a temperature); what is left of the chunk stays with the caller:
//
//     while (machine.has_room() && (line = parser.next(chunk))) { … line->command … }
//
// Push, when it need not: feed(chunk, on_line), finish(on_line).
//
// A line that is malformed gives an error that says what and where, and no command: a malformed
// line never moves anything. Nothing here knows what a code means; see command_table.h and
// interpreter.h.
#pragma once

#include <optional>
#include <span>
#include <string_view>

#include "base/result.h"
#include "printer/gcode/command.h"
#include "printer/gcode/line_reader.h"

namespace qduino::printer::gcode {

/// The content of one line. Views are valid until the parser is used again; the command may be
/// copied and kept.
struct Line : RawLine {
    const Command* command = nullptr;  ///< null when the line holds none, or an error
};

class Parser {
  public:
    /// The next whole line, taken off the front of `input`; null when `input` ran out first.
    [[nodiscard]] const Line* next(std::span<const char>& input) {
        return reader_.next(input, line_) ? parse() : nullptr;
    }
    /// The input has ended: its last line if it had no line end; null when there is none.
    [[nodiscard]] const Line* finish() { return reader_.finish(line_) ? parse() : nullptr; }

    /// Hands every line, empty ones too, to `on_line(const Line&)`, in order.
    template <typename OnLine>
    void feed(std::span<const char> input, OnLine&& on_line) {
        while (const Line* line = next(input)) on_line(*line);
    }
    template <typename OnLine>
    void finish(OnLine&& on_line) {
        if (const Line* line = finish()) on_line(*line);
    }

    /// Begins anew, as if `offset` bytes and `lines` whole lines had been read.
    void reset(std::uint64_t offset = 0, std::uint64_t lines = 0) { reader_.reset(offset, lines); }
    [[nodiscard]] std::uint64_t offset() const { return reader_.offset(); }

  private:
    const Line* parse();

    LineReader reader_;
    Command command_;
    Line line_;
};

/// One line by itself, as typed at a console or sent by a client. `text` must hold one line at
/// most. Error: malformed, or more than one line. An empty optional: a comment, or nothing.
Result<std::optional<Command>> parse_line(std::string_view text);

/// For rings that carry unsigned bytes.
inline std::span<const char> as_chars(std::span<const std::uint8_t> bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace qduino::printer::gcode
