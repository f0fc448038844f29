// The file behind the EEPROM: mapped memory that the kernel keeps.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "base/result.h"

namespace qduino::arduino::host {

/// `size` bytes of the file at `path`, mapped; made, and filled with 0xff, where there is none or it is shorter. The mapping lasts as
/// long as the program. Error: not_permitted, not_found, unavailable, by path.
Result<std::span<std::uint8_t>> map_eeprom(const std::string& path, std::size_t size);
/// Where the EEPROM of this program is, unless it said otherwise. Its folder exists when this returns, if it can.
std::string default_eeprom_path();
/// Waits until what is in `bytes` (a whole mapping) is on the disk.
Result<void> sync_eeprom(std::span<std::uint8_t> bytes);

}  // namespace qduino::arduino::host
