// The file behind the EEPROM: memory that the system keeps. A program is linked with its system's
// (arduino/host, arduino/metal).
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "base/result.h"

namespace qduino::arduino {

/// Maps `size` bytes of the file at `path`; if that is empty, of the program's own file, which
/// QDUINO_EEPROM may name. Makes the file, and fills it with 0xff, where there is none or it is
/// shorter. The mapping lasts as long as the program. Error: not_permitted, not_found, unavailable,
/// with the path; unsupported: the system has no files.
Result<std::span<std::uint8_t>> map_eeprom(const std::string& path, std::size_t size);
/// Waits until `bytes` (a whole mapping) are on the disk.
Result<void> sync_eeprom(std::span<std::uint8_t> bytes);

}  // namespace qduino::arduino
