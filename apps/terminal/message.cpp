#include "apps/terminal/message.h"

#include <unistd.h>

#include <cerrno>

#include "apps/terminal/wrap.h"

namespace qduino::apps {

std::string message(std::string_view text, std::string_view prefix, int descriptor) {
    const bool narrow = ::isatty(descriptor) != 0;
    std::string out;
    std::string begin{prefix};
    while (!text.empty()) {
        const std::size_t end = text.find('\n');
        const std::string_view line = text.substr(0, end);
        out += narrow && begin.size() + line.size() > kColumns ? wrapped(line, begin)
                                                               : begin + std::string{line} + '\n';
        text = end == std::string_view::npos ? std::string_view{} : text.substr(end + 1);
        begin.clear();
    }
    return out;
}

void say(std::string_view text, std::string_view prefix) {
    const std::string all = message(text, prefix, STDERR_FILENO);
    for (std::string_view rest = all; !rest.empty();) {
        const ssize_t count = ::write(STDERR_FILENO, rest.data(), rest.size());
        if (count < 0 && errno == EINTR) continue;
        if (count <= 0) return;  // nobody listens
        rest = rest.substr(static_cast<std::size_t>(count));
    }
}

}  // namespace qduino::apps
