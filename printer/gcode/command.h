// One G-code command as a value: the words of a line, before anything decides what they mean.
//
// A command owns its text, so it may be kept (in a queue, until there is room for its moves) after
// the line that it came from is gone. Trivially copyable, about 600 bytes, no heap.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "base/contract.h"
#include "base/text.h"
#include "printer/gcode/source.h"

namespace qduino::printer::gcode {

/// The parameters of a command by their letter: `X10`, or a bare `X`.
class Parameters {
  public:
    /// Contract of all: `letter` is 'A'…'Z'.
    [[nodiscard]] constexpr bool has(char letter) const { return (present_ & bit(letter)) != 0; }
    /// The number behind the letter; none when the letter is absent or stands alone. Always finite.
    [[nodiscard]] constexpr std::optional<double> value(char letter) const {
        if ((valued_ & bit(letter)) == 0) return std::nullopt;
        return values_[index(letter)];
    }
    [[nodiscard]] constexpr bool empty() const { return present_ == 0; }
    /// Bit 0 is A, bit 25 is Z.
    [[nodiscard]] constexpr std::uint32_t letters() const { return present_; }

    constexpr void add(char letter) { present_ |= bit(letter); }
    constexpr void add(char letter, double value) {
        add(letter);
        valued_ |= bit(letter);
        values_[index(letter)] = value;
    }
    constexpr void clear() { present_ = valued_ = 0; }

    static constexpr std::uint32_t bit(char letter) { return std::uint32_t{1} << index(letter); }

  private:
    static constexpr std::size_t index(char letter) {
        QDUINO_EXPECT(letter >= 'A' && letter <= 'Z');
        return static_cast<std::size_t>(letter - 'A');
    }
    std::uint32_t present_ = 0;
    std::uint32_t valued_ = 0;
    std::array<double, 26> values_{};
};

/// The longest command without its comment, in bytes. Marlin's buffer holds 96; slicers stay below
/// 100.
inline constexpr std::size_t kCommandBytesMax = 256;

struct Command {
    /// 'G', 'M', 'T' …; 'F' or 'S' with number 0 for a speed alone (`F600`); '\0' for a command
    /// that is a word (EXCLUDE_OBJECT_START).
    char letter = '\0';
    std::uint32_t number = 0;
    std::optional<std::uint16_t> subcode{};  ///< 1 in G92.1
    Parameters parameters;
    /// The tail of M117 and its like, a quoted string (M862.3 P "MK3"), or what follows a word.
    /// Valid UTF-8.
    FixedString<kCommandBytesMax> text;
    bool text_cut = false;  ///< `text` holds only the beginning
    FixedString<32> word;   ///< of a word command, in upper case

    Source source;

    /// As a new one, but for the source. (A new one writes 600 bytes, for each line of a job.)
    void clear() {
        letter = '\0';
        number = 0;
        subcode.reset();
        parameters.clear();
        text.clear();
        text_cut = false;
        word.clear();
    }

    /// As it is written: `G1`, `G92.1`, `EXCLUDE_OBJECT`.
    [[nodiscard]] FixedString<32> name() const {
        if (letter == '\0') return word;
        if (letter == 'F' || letter == 'S') return FixedString<32>{std::string_view{&letter, 1}};
        auto name = qduino::text<FixedString<32>>(letter, number);
        return subcode ? write(name, '.', *subcode) : name;
    }
};

}  // namespace qduino::printer::gcode
