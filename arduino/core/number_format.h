// Numbers as text, without heap, locale or stdio: shared by Print and String.
#pragma once

#include <cstddef>
#include <cstdint>

namespace qduino::arduino {

/// Room for 64 binary digits, a sign and a terminator.
inline constexpr std::size_t kIntegerTextMax = 66;
/// Room for a sign, ten digits, a point and kDecimalsMax decimals.
inline constexpr unsigned kDecimalsMax = 30;
inline constexpr std::size_t kFloatTextMax = 1 + 10 + 1 + kDecimalsMax + 1;

/// Writes `value` in `base` (2…36, others count as 10), digits above 9 in upper case, into `out` of
/// at least kIntegerTextMax bytes, terminated. Returns the length.
std::size_t format_unsigned(char* out, std::uint64_t value, unsigned base);
/// The same with a minus sign, which base 10 alone has.
std::size_t format_signed_decimal(char* out, std::int64_t value);

/// Writes `value` with `decimals` digits after the point (at most kDecimalsMax), rounded half away
/// from zero. As Arduino's Print: "nan", "inf", and "ovf" beyond ±4294967040. `out` holds at least
/// kFloatTextMax bytes; terminated.
///
/// A value that a float can hold is worked on as a float, and has the digits that an AVR prints,
/// whose double is one: 333795.0625 with three is 333795.062. Others have a double's precision.
std::size_t format_float(char* out, double value, unsigned decimals);

}  // namespace qduino::arduino
