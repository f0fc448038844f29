// The EEPROM where no system has files: it stays in memory (EEPROM.h), and the sketch hears why.
#include "arduino/libraries/EEPROM/eeprom_file.h"

namespace qduino::arduino {

Result<std::span<std::uint8_t>> map_eeprom(const std::string&, std::size_t) {
    return make_error(ErrorCode::unsupported, "this board has no files: what is written is lost at the end");
}
Result<void> sync_eeprom(std::span<std::uint8_t>) { return {}; }  // nothing is mapped

}  // namespace qduino::arduino
