// The file behind the EEPROM: mapped memory that the kernel keeps.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "base/result.h"

namespace qduino::arduino::host {

/// Maps `size` bytes of the file at `path`. Makes the file, and fills it with 0xff, where there is
/// none or it is shorter. The mapping lasts as long as the program. Error: not_permitted,
/// not_found, unavailable, with the path.
Result<std::span<std::uint8_t>> map_eeprom(const std::string& path, std::size_t size);
/// Waits until `bytes` (a whole mapping) are on the disk.
Result<void> sync_eeprom(std::span<std::uint8_t> bytes);

}  // namespace qduino::arduino::host
