// Which firmware a file is written for, where that changes what it means: the mode of E.
//
//                                           G90 and G91 …      E counts on
//   Marlin 2 (and what is left)             set E's as well    after M83 or G91, to M82 or G90
//   Klipper, RepRapFirmware, Prusa's MK3    leave E's alone    after M83, to M82; and in G91
//
// RepRapFirmware and the MK3 leave E absolute in G91 behind an M82. But end codes of all firmwares
// draw filament back by `G91`, `G1 E-1`, and files with their codes are made for others, too.
//
// A file says it by what only one of them understands: words (SET_VELOCITY_LIMIT, EXCLUDE_OBJECT),
// RepRapFirmware's codes (M572), a slicer's comment (`; gcode_flavor = klipper`). It counts from
// that line on; the machine file may say it once and for all.
//
// Sources: Marlin 2.1 (set_relative_mode); Klipper's documentation and its module for moves; Duet's
// G-code dictionary, G90 and M83; Prusa-Firmware of the MK3 ("E axis is left intact").
#pragma once

#include <string_view>

#include "printer/gcode/command.h"
#include "printer/machine_config.h"

namespace qduino::printer::gcode {

/// The firmware that `command` is for; marlin: it does not say.
[[nodiscard]] Dialect dialect_of(const Command& command);
/// The firmware that a slicer's comment, the text behind `;`, names; marlin: it names none.
[[nodiscard]] Dialect dialect_of_comment(std::string_view comment);

/// For people: whose way it is.
[[nodiscard]] std::string_view name_of(Dialect dialect);

}  // namespace qduino::printer::gcode
