#include "arduino/Print.h"

#include "arduino/core/number_format.h"

using qduino::arduino::format_float;
using qduino::arduino::format_signed_decimal;
using qduino::arduino::format_unsigned;
using qduino::arduino::kFloatTextMax;
using qduino::arduino::kIntegerTextMax;

std::size_t Print::write(const std::uint8_t* buffer, std::size_t size) {
    std::size_t written = 0;
    while (written < size && write(buffer[written]) == 1) ++written;
    return written;
}

std::size_t Print::print_signed(std::int64_t value, std::uint64_t bits, int base) {
    if (base != DEC) return print_unsigned(bits, base);
    char text[kIntegerTextMax];
    return write(text, format_signed_decimal(text, value));
}

std::size_t Print::print_unsigned(std::uint64_t value, int base) {
    if (base == 0) return write(static_cast<std::uint8_t>(value));
    char text[kIntegerTextMax];
    return write(text, format_unsigned(text, value, static_cast<unsigned>(base)));
}

std::size_t Print::print(double value, int decimals) {
    char text[kFloatTextMax];
    return write(text, format_float(text, value, decimals < 0 ? 2U : static_cast<unsigned>(decimals)));
}
