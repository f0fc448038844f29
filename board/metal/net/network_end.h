// One end of a connection, or of a packet's way.
#pragma once

#include <cstdint>

namespace qduino::board::metal {

/// An IPv4 address, its bytes in the network's order, and a port.
struct NetworkEnd {
    std::uint32_t address = 0;
    std::uint16_t port = 0;
};

}  // namespace qduino::board::metal
