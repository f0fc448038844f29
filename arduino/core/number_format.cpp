#include "arduino/core/number_format.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>

namespace qduino::arduino {

namespace {

std::size_t put_text(char* out, const char* text) {
    const std::size_t size = std::strlen(text);
    std::memcpy(out, text, size + 1);
    return size;
}

/// In the order of Arduino's Print (ArduinoCore-avr 1.8.7, Print.cpp): half a unit of the last
/// digit is added, then one digit after the other is cut off. So the last digit is wrong by one
/// where Real is too narrow for that half.
template <typename Real>
std::size_t put_digits(char* out, Real value, unsigned decimals) {
    std::size_t size = 0;
    if (value < 0) {
        out[size++] = '-';
        value = -value;
    }
    Real half = Real{1} / 2;
    for (unsigned i = 0; i < decimals; ++i) half /= 10;
    value += half;
    const auto whole = static_cast<std::uint64_t>(value);
    Real rest = value - static_cast<Real>(whole);
    size += format_unsigned(out + size, whole, 10);
    if (decimals > 0) out[size++] = '.';
    for (unsigned i = 0; i < decimals; ++i) {
        rest *= 10;
        const int digit = std::min(static_cast<int>(rest), 9);
        out[size++] = static_cast<char>('0' + digit);
        rest -= static_cast<Real>(digit);
    }
    out[size] = '\0';
    return size;
}

}  // namespace

std::size_t format_unsigned(char* out, std::uint64_t value, unsigned base) {
    if (base < 2 || base > 36) base = 10;
    char* const end = std::to_chars(out, out + kIntegerTextMax - 1, value, static_cast<int>(base)).ptr;
    std::transform(out, end, out, [](char c) { return c >= 'a' ? static_cast<char>(c - 'a' + 'A') : c; });
    *end = '\0';
    return static_cast<std::size_t>(end - out);
}

std::size_t format_signed_decimal(char* out, std::int64_t value) {
    if (value >= 0) return format_unsigned(out, static_cast<std::uint64_t>(value), 10);
    out[0] = '-';
    return 1 + format_unsigned(out + 1, 0 - static_cast<std::uint64_t>(value), 10);
}

std::size_t format_float(char* out, double value, unsigned decimals) {
    // The largest float below 2^32: Arduino prints no more.
    constexpr double kLargest = 4294967040.0;
    if (std::isnan(value)) return put_text(out, "nan");
    if (std::isinf(value)) return put_text(out, "inf");
    if (value > kLargest || value < -kLargest) return put_text(out, "ovf");
    decimals = std::min(decimals, kDecimalsMax);
    const auto narrow = static_cast<float>(value);
    if (static_cast<double>(narrow) == value) return put_digits(out, narrow, decimals);
    return put_digits(out, value, decimals);
}

}  // namespace qduino::arduino
