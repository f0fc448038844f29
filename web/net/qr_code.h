// A short text as a QR code, for a phone's camera: libqrencode's symbol, drawn for a terminal or
// given out as rows.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace qduino::web {

/// Rows of modules, top first: '1' is dark, without the light border of four that a reader needs.
/// Empty: the text is too long.
using QrCode = std::vector<std::string>;

[[nodiscard]] QrCode qr_code_of(std::string_view text);

/// The code with its border, for a terminal that knows UTF-8 and colours: two modules of a column
/// in each character, black on white whatever the terminal's own colours are.
[[nodiscard]] std::string terminal_picture(const QrCode& code);

}  // namespace qduino::web
