// A format of a sketch, whose `long` has 32 bits, as the C library of a 64-bit system reads it.
#pragma once

#include <array>
#include <string>

namespace qduino::arduino {

/// Whose conversions a format has: scanf's have sets in brackets.
enum class FormatKind { print, scan };

/// `format` without the `l` of each `%ld` and its like: d, i, o, u, x, X and n. `%lld`, `%lf`,
/// `%lc`, `%ls`, `%zu` and `%%` stay. Formats of up to 255 characters need no heap.
class NarrowFormat {
  public:
    NarrowFormat(const char* format, FormatKind kind);
    [[nodiscard]] const char* text() const { return text_; }

  private:
    const char* text_;  // the format itself, when nothing is to be changed
    std::array<char, 256> small_{};
    std::string large_;
};

}  // namespace qduino::arduino
