// The network interface of a host with Linux: what its files tell
// (arduino/libraries/network/interface.h).
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace qduino::arduino::host {

/// The default gateway through the interface `name`, from the text of /proc/net/route; 0: none.
[[nodiscard]] std::uint32_t gateway_in(std::string_view route, std::string_view name);
/// The first IPv4 name server in the text of /etc/resolv.conf; 0: none.
[[nodiscard]] std::uint32_t name_server_in(std::string_view resolv_conf);
/// The signal level in dBm of the interface `name`, from the text of /proc/net/wireless; none: it
/// has no radio.
[[nodiscard]] std::optional<int> signal_in(std::string_view wireless, std::string_view name);

}  // namespace qduino::arduino::host
