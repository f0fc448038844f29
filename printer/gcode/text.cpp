#include "printer/gcode/text.h"

#include <charconv>
#include <cmath>

namespace qduino::printer::gcode {

namespace {

/// All exact: 10^22 is the largest power of ten that a double holds.
constexpr double kPowersOfTen[]{1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
/// So many digits are below 2^53.
constexpr std::size_t kExactDigits = 15;

/// Digits and at most one point, as they are read.
struct Digits {
    std::uint64_t mantissa = 0;  ///< as if there were no point; meaningless past kExactDigits
    std::size_t count = 0;
    std::size_t behind_point = 0;

    void take(std::string_view text, std::size_t& at) {
        const std::size_t before = at;
        for (; at < text.size() && is_digit(text[at]); ++at)
            mantissa = mantissa * 10 + static_cast<std::uint64_t>(text[at] - '0');
        count += at - before;
    }
};

}  // namespace

/// Nearly every number of a job has 15 digits at most. It is then the quotient of two doubles
/// that are exact, which the division rounds correctly (Clinger, How to read floating point
/// numbers accurately, 1990). That takes a quarter of the library's time.
std::optional<double> take_number(std::string_view& text) {
    std::size_t at = 0;
    const bool negative = !text.empty() && text.front() == '-';
    if (negative || (!text.empty() && text.front() == '+')) ++at;
    const std::size_t sign_end = at;
    Digits digits;
    digits.take(text, at);
    if (at < text.size() && text[at] == '.') {
        const std::size_t before = digits.count;
        digits.take(text, ++at);
        digits.behind_point = digits.count - before;
    }
    if (digits.count == 0) return std::nullopt;
    double value = 0;
    if (digits.count <= kExactDigits) {
        value = static_cast<double>(digits.mantissa) / kPowersOfTen[digits.behind_point];
        value = negative ? -value : value;
    } else {
        // The grammar is checked above, so from_chars sees only digits and a point. It does not
        // take a plus sign.
        const char* const first = text.data() + (negative ? 0 : sign_end);
        const char* const last = text.data() + at;
        const auto [end, error] = std::from_chars(first, last, value, std::chars_format::fixed);
        if (error != std::errc{} || end != last || !std::isfinite(value)) return std::nullopt;
    }
    text.remove_prefix(at);
    return value;
}

std::size_t exponent_size(std::string_view text) {
    if (text.size() < 2 || to_upper(text.front()) != 'E') return 0;
    std::size_t at = text[1] == '+' || text[1] == '-' ? 2 : 1;
    const std::size_t digits = at;
    while (at < text.size() && is_digit(text[at])) ++at;
    const bool goes_on = at < text.size() && text[at] == '.';
    return at > digits && !goes_on ? at : 0;
}

std::optional<double> take_scientific(std::string_view& text) {
    std::string_view rest = text;
    const auto plain = take_number(rest);
    if (!plain) return std::nullopt;
    const std::size_t exponent = exponent_size(rest);
    if (exponent == 0) {
        text = rest;
        return plain;
    }
    rest.remove_prefix(exponent);
    // from_chars takes no plus sign in front.
    const std::string_view whole = text.substr(text.front() == '+' ? 1 : 0);
    const char* const last = rest.data();
    double value = 0;
    const auto [end, error] = std::from_chars(whole.data(), last, value);
    if (error != std::errc{} || end != last || !std::isfinite(value)) return std::nullopt;
    text = rest;
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
