// The place of a line in a job: every command, move, comment and error carries it.
#pragma once

#include <cstdint>

namespace qduino::printer::gcode {

/// One line of the input.
///
///     … \n G 1 X 1 0 \r \n …
///          ^         ^   ^
///          offset    |   end_offset: here, or one byte further. A CR alone ends a line, too: the
///                    |   LF of a CR LF pair is swallowed only once it has arrived.
///                    offset + length
struct Source {
    std::uint64_t offset = 0;      ///< of the line's first byte, from the beginning of the input
    std::uint64_t end_offset = 0;  ///< behind the line and its line end: so much has been consumed
    std::uint64_t line = 0;        ///< 1 is the first line
    /// Bytes of the line without its line end. 64 bits, as a hostile line may be as long as the
    /// file.
    std::uint64_t length = 0;

    friend constexpr bool operator==(const Source&, const Source&) = default;
};

}  // namespace qduino::printer::gcode
