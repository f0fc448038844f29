// The [[part]] tables of a board file: chips that are wired to the simulated board.
#pragma once

#include <vector>

#include "board/types.h"
#include "config/part_list.h"
#include "config/toml_section.h"

namespace qduino::apps {

/// The highest numbers that a board file may name.
inline constexpr std::int64_t kLastPin = board::kPinCount - 1, kLastBus = 15;

/// Takes all [[part]] tables of the file into `parts`. Blames a key that the chip of its table does
/// not have, and a pin or an address that has a part already. (Thermometers share a pin.)
void read_parts(TomlSection& root, std::vector<PartSpec>& parts);

}  // namespace qduino::apps
