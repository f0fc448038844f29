#include "apps/terminal/wrap.h"

#include <vector>

namespace qduino::apps {
namespace {

/// Words between spaces; what stands in quotes is part of one word.
std::vector<std::string> words_of(std::string_view text, bool keep_quoted) {
    std::vector<std::string> words;
    std::string word;
    char quote = '\0';
    for (const char c : text) {
        if (c == ' ' && quote == '\0') {
            if (!word.empty()) words.push_back(word);
            word.clear();
            continue;
        }
        if (keep_quoted && quote == '\0' && (c == '\'' || c == '"')) {
            quote = c;
        } else if (c == quote) {
            quote = '\0';
        }
        word += c;
    }
    if (!word.empty()) words.push_back(word);
    return words;
}

std::string joined(const std::vector<std::string>& words, std::string_view prefix,
                   std::string_view broken_end) {
    const std::string indent(prefix.size(), ' ');
    std::string out, line{prefix};
    for (std::size_t i = 0; i < words.size(); ++i) {
        const bool first = line.size() == prefix.size();
        const bool last = i + 1 == words.size();
        const std::size_t needed = words[i].size() + (first ? 0 : 1) + (last ? 0 : broken_end.size());
        if (!first && line.size() + needed > kColumns) {
            out += line + std::string{broken_end} + '\n';
            line = indent;
        }
        if (line.size() > prefix.size()) line += ' ';
        line += words[i];
    }
    return out + line + '\n';
}

}  // namespace

std::string wrapped(std::string_view text, std::string_view prefix) {
    return joined(words_of(text, false), prefix, "");
}

std::string wrapped_command(std::string_view text, std::string_view prefix) {
    const bool command = text.rfind("sudo ", 0) == 0 || text.rfind("echo ", 0) == 0;
    if (!command) return wrapped(text, prefix);

    return joined(words_of(text, true), prefix, " \\");
}

}  // namespace qduino::apps
