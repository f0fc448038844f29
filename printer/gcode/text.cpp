#include "printer/gcode/text.h"

#include <charconv>
#include <cmath>

namespace qduino::printer::gcode {

std::optional<double> take_number(std::string_view& text) {
    std::size_t at = 0;
    if (at < text.size() && (text[at] == '+' || text[at] == '-')) ++at;
    const std::size_t sign_end = at;
    std::size_t digits = 0;
    for (; at < text.size() && is_digit(text[at]); ++at) ++digits;
    if (at < text.size() && text[at] == '.') {
        ++at;
        for (; at < text.size() && is_digit(text[at]); ++at) ++digits;
    }
    if (digits == 0) return std::nullopt;
    // The grammar is checked above, so from_chars sees only digits and a point. It does not take a
    // plus sign.
    const char* const first = text.data() + (text.front() == '+' ? sign_end : 0);
    const char* const last = text.data() + at;
    double value = 0;
    const auto [end, error] = std::from_chars(first, last, value, std::chars_format::fixed);
    if (error != std::errc{} || end != last || !std::isfinite(value)) return std::nullopt;
    text.remove_prefix(at);
    return value;
}

std::optional<std::uint64_t> take_integer(std::string_view& text) {
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{}) return std::nullopt;
    text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    return value;
}

namespace {

/// Well-formed UTF-8 byte sequences: the Unicode standard, table 3-7.
struct Utf8Row {
    unsigned char first_min, first_max, second_min, second_max;
    std::size_t length;
};
constexpr Utf8Row kUtf8Rows[] = {
    {0xC2, 0xDF, 0x80, 0xBF, 2}, {0xE0, 0xE0, 0xA0, 0xBF, 3}, {0xE1, 0xEC, 0x80, 0xBF, 3},
    {0xED, 0xED, 0x80, 0x9F, 3}, {0xEE, 0xEF, 0x80, 0xBF, 3}, {0xF0, 0xF0, 0x90, 0xBF, 4},
    {0xF1, 0xF3, 0x80, 0xBF, 4}, {0xF4, 0xF4, 0x80, 0x8F, 4},
};

bool is_between(unsigned char c, unsigned char low, unsigned char high) { return c >= low && c <= high; }

}  // namespace

std::size_t printable_sequence(std::string_view text) {
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
    if (byte(0) < 0x80) return byte(0) >= 0x20 && byte(0) != 0x7F ? 1 : 0;
    for (const Utf8Row& row : kUtf8Rows) {
        if (!is_between(byte(0), row.first_min, row.first_max)) continue;
        if (text.size() < row.length || !is_between(byte(1), row.second_min, row.second_max)) return 0;
        for (std::size_t i = 2; i < row.length; ++i) {
            if (!is_between(byte(i), 0x80, 0xBF)) return 0;
        }
        const bool is_c1_control = byte(0) == 0xC2 && byte(1) < 0xA0;
        return is_c1_control ? 0 : row.length;
    }
    return 0;
}

}  // namespace qduino::printer::gcode
