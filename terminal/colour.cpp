#include "terminal/colour.h"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>

#include "base/text.h"

namespace qduino::apps {
namespace {

/// Numbers of xterm's 256 colours (XTerm Control Sequences, "Character Attributes (SGR)").
int number_of(Tone tone) {
    switch (tone) {
        case Tone::loop:
            return 32;  // #0087d7
        case Tone::io:
            return 36;  // #00af87
        case Tone::throttled:
            return 178;  // #d7af00
        case Tone::bad:
            return 160;  // #d70000
        case Tone::good:
            return 34;  // #00af00
        case Tone::plain:
            break;
    }
    return 0;
}

}  // namespace

bool wants_colour(int descriptor) {
    const char* const refused = std::getenv("NO_COLOR");
    const char* const terminal = std::getenv("TERM");
    if (refused && *refused) return false;
    return ::isatty(descriptor) != 0 && terminal && *terminal && std::string_view{terminal} != "dumb";
}

std::string painted(std::string_view words, Tone tone, bool wanted) {
    if (!wanted || tone == Tone::plain || words.empty()) return std::string{words};
    return text<std::string>("\x1b[38;5;", number_of(tone), 'm', words, "\x1b[0m");
}

std::string with_outcomes(std::string_view text, bool wanted) {
    constexpr std::string_view kBad[] = {"REFUSED", "refused", "FAILED", "DIED", "OVERRUNs", "OVERRUN"};
    constexpr std::string_view kGood = "admitted", kNotYet = "would be admitted";
    std::string out;
    while (wanted && !text.empty()) {
        const std::string_view word = text.substr(0, text.find_first_of(" \n,:;.", 0));
        const bool bad = std::ranges::find(kBad, word) != std::end(kBad);
        std::size_t taken = word.size();
        if (text.starts_with(kNotYet)) {
            taken = kNotYet.size();
            out += kNotYet;
        } else {
            out += painted(word, bad ? Tone::bad : word == kGood ? Tone::good : Tone::plain, true);
        }
        if (taken < text.size()) out += text[taken++];
        text.remove_prefix(taken);
    }
    return out += text;
}

std::size_t columns_of(std::string_view line) {
    std::size_t columns = 0;
    for (std::size_t i = 0; i < line.size(); ++i) {
        if (line[i] == '\x1b') {
            i = std::min(line.find('m', i), line.size());
        } else if ((line[i] & 0xC0) != 0x80) {
            ++columns;
        }
    }
    return columns;
}

}  // namespace qduino::apps
