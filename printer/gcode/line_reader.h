// Bytes, in whatever pieces they arrive, to lines: the code of each, its comment, or what is wrong
// with it.
//
//     N3 G1 X10 (why) Y20*57 ; say no more \r\n
//     └──── code ───────────┘└ comment ───┘└ LF, CR or CR LF: one line end
//
// Sans I/O, no heap, constant memory: a line is held in one fixed buffer. A comment that does not
// fit is cut; code that does not fit is an error with its position; a line of 10 MB costs its
// passing and nothing else. The bytes decide alone: however the input is cut into chunks, the lines
// are the same (a property test).
//
// Comments: `;` to the end of the line, and `( … )` within it (RS274/NGC, NIST, section 3.3.4). A
// `;` within double quotes belongs to the text; of a word command, where they are around a value.
// In the free text of M117 and its like neither quotes nor parentheses mean anything. A NUL byte
// anywhere: this is not a text, hence not G-code.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "base/result.h"
#include "printer/gcode/command.h"
#include "printer/gcode/source.h"

namespace qduino::printer::gcode {

/// How much of one line is held, comment included.
inline constexpr std::size_t kLineBytesMax = 1024;

enum class Checksum : std::uint8_t { absent, right, wrong };

/// What a serial host puts around a command: `N<number> command*<exclusive or of all bytes before
/// the *>`.
struct HostFrame {
    /// May be negative: Printrun begins with `N-1 M110*15`, so that its first line is number 0.
    std::optional<std::int64_t> number{};
    Checksum checksum = Checksum::absent;  ///< looked for only behind a number, as Marlin does
};

/// A line without its line end. The views are valid until the reader is used again.
struct RawLine {
    std::string_view text;  ///< as it came, as much as is held: to show
    /// Trimmed; without frame and comment; `( … )` is a space, but in free text.
    std::string_view code;
    HostFrame frame{};
    std::string_view comment;      ///< behind the first `;`, not trimmed
    bool comment_cut = false;      ///< the comment was longer than what is held
    std::optional<Error> error{};  ///< then `code` is empty. Names the line and its first byte
    Source source;
};

/// `error`, with the place of its line in front.
[[nodiscard]] Error at_place(const Error& error, const Source& source);

class LineReader {
  public:
    /// Takes bytes off the front of `input` up to the end of one line. False when `input` ran out
    /// first (it is empty then, and what it held is kept). A UTF-8 byte order mark at the very
    /// beginning is skipped.
    [[nodiscard]] bool next(std::span<const char>& input, RawLine& line);

    /// The input has ended: delivers a last line that has no line end. False when there is none.
    [[nodiscard]] bool finish(RawLine& line);

    /// Begins anew, as if `offset` bytes and `lines` whole lines had been read: for a job that is
    /// resumed.
    void reset(std::uint64_t offset = 0, std::uint64_t lines = 0);

    /// Bytes taken so far.
    [[nodiscard]] std::uint64_t offset() const { return offset_; }

  private:
    void take(std::span<const char> piece);
    void deliver(RawLine& line);
    std::optional<Error> split(RawLine& line);
    std::optional<Error> remove_parentheses(RawLine& line);

    std::array<char, kLineBytesMax> held_{};
    std::array<char, kCommandBytesMax> code_{};
    std::size_t held_count_ = 0;
    std::uint64_t offset_ = 0;  ///< bytes taken
    std::uint64_t line_offset_ = 0;
    std::uint64_t line_length_ = 0;
    std::uint64_t lines_ = 0;
    std::uint64_t first_nul_ = kNone;  ///< offset of the line's first NUL byte
    bool after_cr_ = false;            ///< a LF that follows now belongs to the line end before

    static constexpr std::uint64_t kNone = ~std::uint64_t{0};
};

}  // namespace qduino::printer::gcode
