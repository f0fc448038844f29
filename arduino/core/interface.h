// The network interface of the computer, as a sketch asks for it: its addresses, its hardware
// address, how well its radio hears. All is read anew: the system may change it.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

namespace qduino::arduino {

/// IPv4 addresses with their bytes in network order; 0: none.
struct Interface {
    std::uint32_t address = 0, mask = 0, gateway = 0, name_server = 0;
    std::array<std::uint8_t, 6> hardware_address{};
    std::optional<int> signal_dbm{};  ///< none: it has no radio
};

/// The first one with an address that is not the loopback's; without one, zeros. A program is
/// linked with that of its system, as with its sockets (core/socket.h).
[[nodiscard]] Interface first_interface();

}  // namespace qduino::arduino
