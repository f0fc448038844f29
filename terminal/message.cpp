#include "terminal/message.h"

#include <unistd.h>

#include <algorithm>

#include "base/text.h"
#include "posix/small_file.h"
#include "terminal/colour.h"

namespace qduino::apps {

std::string message(std::string_view words, std::string_view prefix, int descriptor) {
    const bool narrow = ::isatty(descriptor) != 0;
    std::string out;
    while (!words.empty()) {
        const std::string_view line = words.substr(0, words.find('\n'));
        const bool fits = !narrow || columns_of(prefix) + columns_of(line) <= kColumns;
        out += fits ? text<std::string>(prefix, line, '\n') : wrapped(line, prefix);
        words.remove_prefix(std::min(line.size() + 1, words.size()));
        prefix = {};
    }
    return out;
}

std::string verdict(const std::string& words, bool colours) {
    return "Verdict: " + with_outcomes(words, colours) + "\n";
}

std::string verdict(const std::string& words) { return verdict(words, wants_colour(STDERR_FILENO)); }

void say(std::string_view words, std::string_view prefix) {
    // A failure: nobody listens.
    static_cast<void>(posix::write_all(STDERR_FILENO, message(words, prefix, STDERR_FILENO), "a message"));
}

}  // namespace qduino::apps
