// Every code that this printer knows: its name, the parameters it takes, and whether it is carried out.
//
// The dialect is Marlin's as slicers and hosts emit it. A code that is not in the table is unknown:
// answered, skipped.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "printer/gcode/command.h"

namespace qduino::printer::gcode {

enum class CodeStatus : std::uint8_t {
    executed,      ///< the interpreter has a handler for it
    acknowledged,  ///< known, not yet done: said by name, then skipped
};

/// What happens to a parameter that is not in `parameters`.
enum class Strictness : std::uint8_t {
    lenient,  ///< ignored, as Marlin does
    strict,   ///< an error: codes that move or move the coordinates must say only what is understood
};

struct CodeInfo {
    char letter;  ///< '\0': a word command, matched by `word`
    std::uint32_t number;
    std::int32_t subcode;         ///< −1: none
    std::string_view word;        ///< of a word command
    std::string_view name;        ///< what it does, for people: "linear move"
    std::string_view parameters;  ///< letters
    CodeStatus status;
    Strictness strictness;
};

/// All known codes.
std::span<const CodeInfo> known_codes();

/// Null when unknown. A subcode that is not listed is unknown, except where every subcode is meant
/// (M862.x).
const CodeInfo* find_code(const Command& command);

/// True for codes whose tail is one text, not words: M117, M118, M0 …, and the SD card's file names.
bool takes_free_text(char letter, std::uint32_t number);

/// True when the tail of `letter``number` must be words or else the line is malformed: codes that are
/// executed, but for those of free text. What is skipped anyway may say what it likes (`M486 Apart (1)`,
/// `M1002 action : 2`).
bool must_be_words(char letter, std::uint32_t number);

}  // namespace qduino::printer::gcode
