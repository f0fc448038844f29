#include "arduino/metal/loader_words.h"

#include <algorithm>

namespace qduino::arduino::metal {
namespace {

constinit std::string_view kept;

}  // namespace

void keep_loader_words(std::string_view words) { kept = words; }

std::string loader_word(std::string_view name) {
    for (std::string_view words = kept; !words.empty();) {
        const std::string_view word = words.substr(0, words.find(' '));
        if (word.starts_with(name) && word.substr(name.size()).starts_with('='))
            return std::string(word.substr(name.size() + 1));
        words.remove_prefix(std::min(words.size(), word.size() + 1));
    }
    return {};
}

}  // namespace qduino::arduino::metal
