// Lines of G-code, cut to the words that carry geometry: one command and its numbers, or a word
// and its text, without comments and check sums.
//
//   "N12 G1 X10.5 E-.8 ; comment*37"  →  letter G, number 1, words {X: 10.5, E: −0.8}
//
// Comments are RS274's: `( … )` is a blank, and a `;` in it or in quotes is none. The E behind a
// digit is an exponent, `X4e1` is X40; where words stand without blanks (`G1X60Y40E1`) it is a
// word, unless it is as programs write exponents (`e+3`, `e-05`).
//
// This reader is the twin's own and shares nothing with the firmware's parser: a mistake in one
// must not hide in the other. Bounded: a line keeps its first kLineBytes bytes; the rest
// (thumbnails, settings in comments) is dropped.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "twin/byte_source.h"
#include "twin/machine.h"

namespace qduino::twin {

/// One command: its letter and number, and for every letter of the alphabet the number that
/// followed it.
struct CommandLine {
    char letter = 0;  ///< 'G' or 'M'; 0 when the line commands nothing, or begins with a word
    int number = -1;
    int subcode = 0;            ///< the 1 of G92.1
    std::uint32_t present = 0;  ///< bit per letter, with or without a number
    std::uint32_t numbers = 0;  ///< likewise, with one
    std::array<double, 26> values{};
    /// A slicer's word in a comment for the firmware that the file is for.
    Flavour flavour = Flavour::marlin;
    std::string word{};  ///< of a command that is a word (SET_GCODE_OFFSET), in upper case
    std::string tail{};  ///< … and what follows it; of others, what stands in quotes
    /// Where a line was typed: see AskedLines::insert.
    struct Typed {
        std::uint64_t behind = 0;
        double left_mm = 0;
    };
    std::optional<Typed> typed{};

    [[nodiscard]] bool has(char name) const { return (present >> (name - 'A') & 1u) != 0; }
    [[nodiscard]] bool has_number(char name) const { return (numbers >> (name - 'A') & 1u) != 0; }
    [[nodiscard]] double value(char name, double otherwise = 0) const {
        return has(name) ? values[static_cast<std::size_t>(name - 'A')] : otherwise;
    }
    /// The value of `KEY=VALUE` behind a word command, with keys in any case. It ends at a blank;
    /// quotes around it are taken off.
    [[nodiscard]] std::optional<std::string_view> word_value(std::string_view key) const;
    /// Likewise, but a name: it is as long as it is, and ends where one of the word's `others` keys
    /// begins, or with the line. Quotes around all of it are taken off.
    [[nodiscard]] std::optional<std::string_view> word_name(
        std::string_view key, std::initializer_list<std::string_view> others) const;
    [[nodiscard]] std::optional<double> word_number(std::string_view key) const;
};

class LineReader {
  public:
    static constexpr std::size_t kLineBytes = 1024;

    explicit LineReader(ByteSource& source) : source_(source), buffer_(std::size_t{1} << 16) {}

    /// The next line's command, or nothing at the end of the source. A line ends with LF, CR, or CR
    /// and LF.
    [[nodiscard]] std::optional<CommandLine> next() {
        char line[kLineBytes];
        std::size_t size = 0;
        bool any = false;
        for (;;) {
            if (at_ == filled_ && !refill()) break;
            const char c = buffer_[at_++];
            if (std::exchange(after_cr_, false) && c == '\n') continue;
            any = true;
            after_cr_ = c == '\r';
            if (c == '\n' || c == '\r') break;
            if (size < kLineBytes) line[size++] = c;
        }
        if (!any) return std::nullopt;
        ++number_;
        std::string_view text{line, size};
        constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";  // some editors begin a file so
        if (number_ == 1 && text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
        return parse(text);
    }
    /// Number of the line that next() gave last, from 1.
    [[nodiscard]] std::uint64_t number() const { return number_; }

    [[nodiscard]] static CommandLine parse(std::string_view line);

  private:
    bool refill() {
        at_ = 0;
        filled_ = source_.read(buffer_);
        return filled_ != 0;
    }

    ByteSource& source_;
    std::vector<char> buffer_;
    std::size_t at_ = 0;
    std::size_t filled_ = 0;
    std::uint64_t number_ = 0;
    bool after_cr_ = false;  // the last line ended with it
};

}  // namespace qduino::twin
