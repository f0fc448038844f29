// Tells from the first bytes of an upload whether it is G-code at all, before anything is made of
// it.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "printer/machine_config.h"

namespace qduino::printer::gcode {

enum class Content : std::uint8_t {
    gcode,
    empty,
    binary_gcode,  ///< Prusa's .bgcode, magic `GCDE`
    archive,       ///< ZIP: a .3mf, .gcode.3mf or .ufp
    packed,        ///< gzip and its like
    utf16,         ///< text, two bytes to a character
    cut_off,       ///< a text, and then nothing but NUL bytes
    binary,        ///< a picture, a binary STL …: control characters
    model,         ///< a text that is a model: STL, STEP, OBJ
    web_page,
    machine_tool,  ///< for a mill or a lathe: several commands on a line, a program's number
    other_text,    ///< text, but no line of it looks like a command or a `;` comment
};

/// Judges by the first `bytes` of a file; 4 KiB are plenty, fewer will do. A macro of `machine` is
/// a command like others.
Content look_at_content(std::span<const char> bytes, const MachineConfig& machine);

/// For people: what it is and what to do; empty for gcode.
std::string_view explain(Content content);

}  // namespace qduino::printer::gcode
