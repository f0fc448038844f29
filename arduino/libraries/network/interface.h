// The network interface of the computer, as a sketch asks for it: its addresses, its hardware
// address, how well its radio hears. All is read anew: the system may change it. A program is
// linked with those of its system, as with its sockets (socket.h).
#pragma once

#include <array>
#include <cstdint>
#include <optional>

namespace qduino::arduino {

/// IPv4 addresses with their bytes in network order; 0: none.
struct Interface {
    std::uint32_t address = 0, mask = 0;
    std::array<std::uint8_t, 6> hardware_address{};
};

/// The first one with an address that is not the loopback's; without one, zeros.
[[nodiscard]] Interface first_interface();
/// The gateway of that interface, and the host's name server; 0: none.
[[nodiscard]] std::uint32_t gateway();
[[nodiscard]] std::uint32_t name_server();
/// The level that its radio hears, in dBm; none: it has no radio.
[[nodiscard]] std::optional<int> signal_dbm();

}  // namespace qduino::arduino
