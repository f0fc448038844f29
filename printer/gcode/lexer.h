// Turns the code of one line into a command: letters and numbers, and nothing about what they mean.
//
//     G1 X10.5 Y-.25 E3     g1x10.5y-.25e3      G 1 X 10.5 Y -.25 E 3      G92.1      M117 any text
//     code parameters       the same            the same                   subcode    code text
//
// E is an axis, and also begins an exponent: behind a digit, with digits behind it (`X4e1`,
// `E8.5e-05`). In a packed line, whose words stand without blanks, it is the axis there, too
// (`G1X60Y40E1`), unless it is as printf writes exponents (`e+3`, `e-05`). command_table.h says
// which codes have a text for a tail. A code that is not executed may have any tail; the tail is
// its text when it does not read as words.
//
// F and S without a code in front of them are a command of their own, number 0: the modal words of
// RS274 (`F600`). A word command is a line whose first two characters are letters:
// `EXCLUDE_OBJECT_START NAME=cube`. The part behind the word is its text. Facts: RS274/NGC (NIST,
// Kramer et al. 2000), section 3.3.2, for letter-number words; Marlin for the strings; Klipper for
// word commands.
//
// Errors: a letter twice, a malformed number, two commands on a line, a byte that is not text, a
// quote without its end, a word of more than 32 letters.
#pragma once

#include <cstdint>
#include <string_view>

#include "base/result.h"
#include "printer/gcode/command.h"

namespace qduino::printer::gcode {

/// Reads `code` (no comment, no host frame) into `command`; `source` is left alone. False: it is
/// empty. The error says what is wrong, without the place. `command` is unspecified then.
Result<bool> parse_words(std::string_view code, Command& command);

/// A code that starts as a word does: two letters, or a letter and an underscore.
bool is_word_command(std::string_view code);

/// The word that such a code starts with, in any case.
std::string_view leading_word(std::string_view code);

/// The letter and number that `code` starts with, e.g. {'M', 117}; letter '\0' when it does not.
struct LeadingCode {
    char letter = '\0';
    std::uint32_t number = 0;
};
LeadingCode leading_code(std::string_view code);

}  // namespace qduino::printer::gcode
