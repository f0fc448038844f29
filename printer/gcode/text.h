// Characters and bounded text, free of the locale, for all parts of the G-code reader.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "base/text.h"

namespace qduino::printer::gcode {

constexpr bool is_space(char c) { return c == ' ' || c == '\t'; }
constexpr bool is_digit(char c) { return c >= '0' && c <= '9'; }
constexpr bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
constexpr char to_upper(char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c; }

constexpr std::string_view trim(std::string_view text) {
    while (!text.empty() && is_space(text.front())) text.remove_prefix(1);
    while (!text.empty() && is_space(text.back())) text.remove_suffix(1);
    return text;
}

/// True when `text` starts with `prefix`, which is then cut off.
constexpr bool skip_prefix(std::string_view& text, std::string_view prefix) {
    if (!text.starts_with(prefix)) return false;
    text.remove_prefix(prefix.size());
    return true;
}

/// Takes a decimal number off the front of `text`: sign, digits, at most one point; no exponent, no
/// hexadecimal, no "inf" or "nan". Correctly rounded (std::from_chars) and always finite. None, and
/// nothing taken, when there is none.
std::optional<double> take_number(std::string_view& text);

/// Bytes of an exponent at the front of `text`: e or E, perhaps a sign, digits, and behind them
/// neither a point nor anything else of a number. 0: none stands there.
std::size_t exponent_size(std::string_view text);

/// As take_number, with the exponent that follows it, if one does. None, and nothing taken, also
/// when a double cannot hold the number.
std::optional<double> take_scientific(std::string_view& text);

/// Takes decimal digits off the front. None, and nothing taken, when there are none or they exceed
/// 64 bits.
std::optional<std::uint64_t> take_integer(std::string_view& text);

/// Length of the valid UTF-8 sequence at the front of `text` that stands for a printable character;
/// 0 when the first byte begins none (a control character, an overlong form, a surrogate, a stray
/// byte).
std::size_t printable_sequence(std::string_view text);

/// Appends the printable UTF-8 of `text`, and `?` for each other byte; never cuts a character in
/// two. Text from a file may then go into JSON, a log and a terminal. False when it did not fit
/// whole.
template <std::size_t N>
bool append_printable(FixedString<N>& out, std::string_view text) {
    while (!text.empty()) {
        const std::size_t count = printable_sequence(text);
        const std::string_view piece = count == 0 ? std::string_view{"?"} : text.substr(0, count);
        if (out.size() + piece.size() > N) return false;
        out.append(piece);
        text.remove_prefix(count == 0 ? 1 : count);
    }
    return true;
}

/// Likewise, but a blank for a tab, and `\xE9` for a byte that is none: texts that differ still do.
template <std::size_t N>
bool append_escaped(FixedString<N>& out, std::string_view text) {
    constexpr std::string_view kHex = "0123456789ABCDEF";
    while (!text.empty()) {
        const std::size_t count = printable_sequence(text);
        const auto byte = static_cast<unsigned char>(text.front());
        const char escaped[]{'\\', 'x', kHex[byte >> 4], kHex[byte & 15]};
        const std::string_view piece = is_space(text.front()) ? std::string_view{" "}
                                       : count == 0           ? std::string_view{escaped, sizeof escaped}
                                                              : text.substr(0, count);
        if (out.size() + piece.size() > N) return false;
        out.append(piece);
        text.remove_prefix(count == 0 ? 1 : count);
    }
    return true;
}

}  // namespace qduino::printer::gcode
