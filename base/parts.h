// Parts of a text, between separators.
#pragma once

#include <algorithm>
#include <cstddef>
#include <string_view>
#include <vector>

namespace qduino {

/// Cuts the part before the next `separator` off `text`, and the separator with it.
inline std::string_view cut(std::string_view& text, char separator) {
    const std::string_view part = text.substr(0, text.find(separator));
    text.remove_prefix(std::min(part.size() + 1, text.size()));
    return part;
}

/// What stands between any of `separators`; empty parts are left out.
inline std::vector<std::string_view> parts(std::string_view text, std::string_view separators) {
    std::vector<std::string_view> found;
    for (std::size_t at = 0; (at = text.find_first_not_of(separators, at)) != std::string_view::npos;) {
        found.push_back(text.substr(at, text.find_first_of(separators, at) - at));
        at += found.back().size();
    }
    return found;
}

}  // namespace qduino
