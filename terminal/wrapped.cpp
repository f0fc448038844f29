#include "terminal/message.h"

#include "base/text.h"
#include "terminal/colour.h"

namespace qduino::apps {
namespace {

/// Words between spaces; with `keep_quoted`, what stands in quotes is part of one word.
std::vector<std::string> words_of(std::string_view line, bool keep_quoted) {
    std::vector<std::string> words(1);
    char quote = '\0';
    for (const char c : line) {
        if (keep_quoted && (c == '\'' || c == '"')) quote = quote == '\0' ? c : quote == c ? '\0' : quote;
        if (c != ' ' || quote != '\0') {
            words.back() += c;
        } else if (!words.back().empty()) {
            words.emplace_back();
        }
    }
    if (words.back().empty()) words.pop_back();
    return words;
}

std::string joined(const std::vector<std::string>& words, std::string_view prefix,
                   std::string_view broken_end) {
    std::string out, line{prefix};
    for (std::size_t i = 0; i < words.size(); ++i) {
        const bool last = i + 1 == words.size();
        const std::size_t needed = 1 + columns_of(words[i]) + (last ? 0 : broken_end.size());
        if (line.size() > prefix.size() && columns_of(line) + needed > kColumns) {
            write(out, line, broken_end, '\n');
            line.assign(columns_of(prefix), ' ');
        }
        if (line.size() > prefix.size()) line += ' ';
        line += words[i];
    }
    return write(out, line, '\n');
}

}  // namespace

std::string wrapped(std::string_view words, std::string_view prefix) {
    return wrapped(words_of(words, false), prefix);
}

std::string wrapped(const std::vector<std::string>& pieces, std::string_view prefix) {
    return joined(pieces, prefix, "");
}

std::string wrapped_command(std::string_view words, std::string_view prefix) {
    const bool command = words.starts_with("sudo ") || words.starts_with("echo ");
    return command ? joined(words_of(words, true), prefix, " \\") : wrapped(words, prefix);
}

}  // namespace qduino::apps
