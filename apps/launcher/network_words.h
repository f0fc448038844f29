// What somebody at another computer or a phone needs: the printer's name, a QR code, and the
// fingerprint to compare.
#pragma once

#include <string>
#include <string_view>

namespace qduino::launcher {

/// `line`: printd's first, "https://192.168.1.5:8080/#key=… AB:CD:…". `name`: the printer's; empty:
/// none. `picture`: with the QR code, for a terminal. Ends with an empty line.
[[nodiscard]] std::string network_words(std::string_view line, std::string_view name, int port, bool picture);

}  // namespace qduino::launcher
