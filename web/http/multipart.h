// multipart/form-data as it streams in (RFC 7578, RFC 2046 §5.1, file names after RFC 5987). Sans
// I/O.
//
//   preamble  CRLF--boundary CRLF  headers CRLF CRLF  data  CRLF--boundary CRLF … CRLF--boundary--
//             ╰─ delimiter ─╯
//
// Bytes go in in any pieces; parts come out through a sink. The parser holds at most one
// delimiter's length of data and one part's headers. A body without its end boundary is an error
// from finish(), and never a wait or a loop: each step uses bytes up or asks for more.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "base/result.h"

namespace qduino::web {

struct PartHead {
    std::string name;
    std::string file_name;  ///< as sent, decoded; untrusted: check before use
    bool is_file = false;   ///< it has a file name, be it an empty one
};

/// An Error from any of these ends the parsing with that error.
class MultipartSink {
  public:
    virtual ~MultipartSink() = default;
    [[nodiscard]] virtual Result<void> part_begin(const PartHead& head) = 0;
    [[nodiscard]] virtual Result<void> part_data(std::span<const char> bytes) = 0;
    [[nodiscard]] virtual Result<void> part_end() = 0;
};

struct MultipartLimits {
    std::size_t parts_max = 32;
    std::size_t header_bytes_max = 8 * 1024;  ///< of one part
    std::size_t preamble_bytes_max = 4 * 1024;
};

/// The boundary in a Content-Type. Errors: unsupported (no multipart/form-data), invalid_argument
/// (no or a bad boundary).
[[nodiscard]] Result<std::string> boundary_of(std::string_view content_type);

class MultipartParser {
  public:
    /// `sink` outlives the parser. `boundary` as boundary_of() gives it.
    MultipartParser(std::string_view boundary, MultipartSink& sink, MultipartLimits limits = {});

    /// Errors: invalid_argument (malformed), out_of_range (a limit), or the sink's. After an error
    /// nothing more is taken.
    [[nodiscard]] Result<void> feed(std::span<const char> bytes);
    /// The body has ended. Error: invalid_argument, when its end boundary was missing.
    [[nodiscard]] Result<void> finish() const;

  private:
    enum class State : std::uint8_t { preamble, after_delimiter, headers, data, epilogue, failed };

    /// One step on held_; false when more bytes are needed.
    [[nodiscard]] Result<bool> step();
    [[nodiscard]] Result<bool> step_to_delimiter();
    [[nodiscard]] Result<bool> step_after_delimiter();
    [[nodiscard]] Result<bool> step_headers();
    [[nodiscard]] Result<void> give_out(std::size_t count);
    void drop(std::size_t count) { at_ += count; }

    std::string delimiter_;  // CRLF--boundary
    MultipartSink& sink_;
    MultipartLimits limits_;
    State state_ = State::preamble;
    std::string held_;
    std::size_t at_ = 0;  // start of what is not yet used in held_
    std::size_t parts_ = 0;
    std::size_t preamble_bytes_ = 0;
};

}  // namespace qduino::web
