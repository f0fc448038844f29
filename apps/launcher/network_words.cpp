#include "apps/launcher/network_words.h"

#include <algorithm>

#include "base/parts.h"
#include "base/text.h"
#include "web/net/qr_code.h"

namespace qduino::launcher {

std::string network_words(std::string_view line, std::string_view name, int port, bool picture) {
    line = line.substr(0, line.find('\n'));
    const std::string_view link = cut(line, ' '), fingerprint = line;
    const std::size_t path = link.find("/#");
    // 32 bytes of "AB:" are wider than a terminal: 16 of them a line.
    const std::size_t half = std::min<std::size_t>(16 * 3, fingerprint.size());
    std::string words;
    if (!name.empty())
        write(words, "  Name   https://", name, ".local:", port,
              path == std::string_view::npos ? "/" : link.substr(path), "\n\n");
    if (picture) write(words, web::terminal_picture(web::qr_code_of(link)), '\n');
    if (!fingerprint.empty())
        write(words, "  The certificate's SHA-256, which a browser shows behind its warning:\n  ",
              fingerprint.substr(0, half), "\n  ", fingerprint.substr(half), "\n\n");
    return words;
}

}  // namespace qduino::launcher
