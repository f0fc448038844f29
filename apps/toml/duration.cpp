#include "apps/toml/duration.h"

#include <array>
#include <cstdint>
#include <numeric>
#include <utility>

namespace qduino::apps {
namespace {

constexpr std::array<std::pair<std::string_view, std::int64_t>, 7> kUnits{{{"ns", 1},
                                                                           {"us", 1'000},
                                                                           {"µs", 1'000},
                                                                           {"ms", 1'000'000},
                                                                           {"s", 1'000'000'000},
                                                                           {"min", 60'000'000'000},
                                                                           {"h", 3'600'000'000'000}}};

bool is_digit(char c) { return c >= '0' && c <= '9'; }

std::string_view trimmed(std::string_view text) {
    while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
    while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
    return text;
}

/// Takes the digits off the front of `text`. False when there are none.
bool take_digits(std::string_view& text, std::string_view& digits) {
    std::size_t count = 0;
    while (count < text.size() && is_digit(text[count])) ++count;
    digits = text.substr(0, count);
    text.remove_prefix(count);
    return count > 0;
}

std::optional<std::int64_t> unit_of(std::string_view name) {
    for (const auto& [known, ns] : kUnits) {
        if (known == name) return ns;
    }
    return std::nullopt;
}

/// 0.`digits` of `unit_ns`, when that is a whole number.
std::optional<std::int64_t> fraction_of(std::int64_t unit_ns, std::string_view digits) {
    while (!digits.empty() && digits.back() == '0') digits.remove_suffix(1);
    if (digits.size() > 15) return std::nullopt;  // finer than a nanosecond, whatever the unit
    std::int64_t value = 0, scale = 1;
    for (const char digit : digits) {
        value = value * 10 + (digit - '0');
        scale *= 10;
    }
    const std::int64_t common = std::gcd(unit_ns, scale);
    const std::int64_t divisor = scale / common;
    if (value % divisor != 0) return std::nullopt;
    return unit_ns / common * (value / divisor);
}

}  // namespace

std::optional<Nanoseconds> parse_duration(std::string_view text) {
    text = trimmed(text);
    std::string_view whole, fraction;
    if (!take_digits(text, whole)) return std::nullopt;
    if (!text.empty() && text.front() == '.') {
        text.remove_prefix(1);
        if (!take_digits(text, fraction)) return std::nullopt;
    }
    const std::optional<std::int64_t> unit = unit_of(trimmed(text));
    if (!unit) return std::nullopt;

    std::int64_t ns = 0;
    for (const char digit : whole) {
        if (__builtin_mul_overflow(ns, 10, &ns) || __builtin_add_overflow(ns, digit - '0', &ns))
            return std::nullopt;
    }
    if (__builtin_mul_overflow(ns, *unit, &ns)) return std::nullopt;
    const std::optional<std::int64_t> rest = fraction_of(*unit, fraction);
    if (!rest || __builtin_add_overflow(ns, *rest, &ns)) return std::nullopt;
    return Nanoseconds{ns};
}

}  // namespace qduino::apps
