// The parameters of a command that is a word: `SET_VELOCITY_LIMIT ACCEL=500 NAME="a b"`.
//
// Facts: Klipper's documentation, "G-Codes" (extended commands). Keys in any case; a value ends at
// a blank, unless quotes are around it.
#pragma once

#include <initializer_list>
#include <optional>
#include <string_view>

#include "base/result.h"
#include "printer/gcode/command.h"

namespace qduino::printer::gcode {

/// The value behind `key=` in `text`; none when the key is absent. `key` is in upper case.
[[nodiscard]] std::optional<std::string_view> word_value(std::string_view text, std::string_view key);

/// The name behind `key=`, whole: it may hold blanks, quotes and `=`. It ends where a blank and one
/// of the `others=` follow, the word's other keys, or with the line. Quotes around it are taken
/// off: the first and the last character. Slicers write names in quotes, bare, and with quotes in
/// them. None: the key is absent. Error: the command is longer than what is kept, so the name may
/// be cut.
[[nodiscard]] Result<std::optional<std::string_view>> word_name(
    const Command& command, std::string_view key, std::initializer_list<std::string_view> others);

/// The number behind `key=`. Error: something else stands there.
[[nodiscard]] Result<std::optional<double>> word_number(const Command& command, std::string_view key);
/// As above, and an error unless `low` ≤ value ≤ `high`.
[[nodiscard]] Result<std::optional<double>> word_number_within(const Command& command, std::string_view key,
                                                               double low, double high);

}  // namespace qduino::printer::gcode
