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
    binary,        ///< a picture, an archive, an STL …: NUL bytes, or most of it not text
    other_text,    ///< text, but no line of it looks like a command or a `;` comment
};

/// Judges by the first `bytes` of a file; 4 KiB are plenty, fewer will do. A macro of `machine` is
/// a command like others.
Content look_at_content(std::span<const char> bytes, const MachineConfig& machine);

/// For people: what it is and what to do; empty for gcode.
std::string_view explain(Content content);

}  // namespace qduino::printer::gcode
