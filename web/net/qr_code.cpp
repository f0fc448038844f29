#include "web/net/qr_code.h"

#include <qrencode.h>

#include <memory>

namespace qduino::web {

QrCode qr_code_of(std::string_view text) {
    struct Free {
        void operator()(QRcode* code) const { QRcode_free(code); }
    };
    const std::string words{text};
    const std::unique_ptr<QRcode, Free> made{QRcode_encodeString8bit(words.c_str(), 0, QR_ECLEVEL_L)};
    QrCode rows;
    if (!made) return rows;
    const auto width = static_cast<std::size_t>(made->width);
    for (std::size_t y = 0; y < width; ++y) {
        std::string& row = rows.emplace_back();
        for (std::size_t x = 0; x < width; ++x) row += (made->data[y * width + x] & 1) != 0 ? '1' : '0';
    }
    return rows;
}

std::string terminal_picture(const QrCode& code) {
    constexpr int kBorder = 2;  // of the four; a terminal's own surroundings are the rest
    const int size = static_cast<int>(code.size());
    const auto is_dark = [&](int x, int y) {
        const bool inside = x >= 0 && y >= 0 && x < size && y < size;
        return inside && code[static_cast<std::size_t>(y)][static_cast<std::size_t>(x)] == '1';
    };
    std::string picture;
    for (int y = -kBorder; y < size + kBorder; y += 2) {
        picture += "  \x1b[30;107m";
        for (int x = -kBorder; x < size + kBorder; ++x) {
            const bool upper = is_dark(x, y), lower = is_dark(x, y + 1);
            picture += upper && lower ? "█" : upper ? "▀" : lower ? "▄" : " ";
        }
        picture += "\x1b[0m\n";
    }
    return picture;
}

}  // namespace qduino::web
