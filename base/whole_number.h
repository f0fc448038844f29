// A whole number out of text: all of the text, or nothing.
#pragma once

#include <charconv>
#include <concepts>
#include <optional>
#include <string_view>

namespace qduino {

/// `base` is 2 to 36. Nothing when `text` is empty, when it holds anything else (a space, a plus
/// sign), or when T cannot hold the number.
template <std::integral T>
[[nodiscard]] std::optional<T> whole_number(std::string_view text, int base = 10) {
    T value{};
    const char* const end = text.data() + text.size();
    const auto [stopped, failed] = std::from_chars(text.data(), end, value, base);
    if (failed != std::errc{} || stopped != end) return std::nullopt;
    return value;
}

}  // namespace qduino
