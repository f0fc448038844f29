// The addresses of this computer.
#pragma once

#include <string>
#include <vector>

namespace qduino::printd {

/// The IPv4 addresses of its interfaces that are up, loopback among them, in order. IPv6 is left
/// out: its addresses change by the day (RFC 8981), and a certificate should not.
[[nodiscard]] std::vector<std::string> own_addresses();

/// The one that others on the network most likely reach: the source address of the default route;
/// else the first that is not loopback's; empty: none.
[[nodiscard]] std::string address_for_others();

}  // namespace qduino::printd
