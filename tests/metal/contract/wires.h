// Where the `out` of a pin ends in the contract's image.
#pragma once

#include <cstdint>

namespace qduino::board::metal {

/// What is connected to the pins gets to know `byte` (board/metal/pins.h), now.
void write_to_wires(std::uint16_t port, std::uint8_t byte);

}  // namespace qduino::board::metal
