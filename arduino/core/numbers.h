// Arithmetic of the Arduino language: min, max, constrain, map, bits, random.
//
// Functions where Arduino's AVR core has macros: an argument is evaluated once, and standard
// headers stay whole.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <type_traits>

#include "arduino/core/constants.h"

/// The result has the type that arithmetic on both arguments has.
template <typename A, typename B>
constexpr std::common_type_t<A, B> min(const A& a, const B& b) {
    const auto x = static_cast<std::common_type_t<A, B>>(a);
    const auto y = static_cast<std::common_type_t<A, B>>(b);
    return y < x ? y : x;
}
template <typename A, typename B>
constexpr std::common_type_t<A, B> max(const A& a, const B& b) {
    const auto x = static_cast<std::common_type_t<A, B>>(a);
    const auto y = static_cast<std::common_type_t<A, B>>(b);
    return x < y ? y : x;
}
/// `value`, or the bound that it exceeds.
/// The result has the type that arithmetic on all three has: constrain(5, 0.5, 2.5) is 2.5.
template <typename T, typename L, typename H>
constexpr std::common_type_t<T, L, H> constrain(T value, L low, H high) {
    using Result = std::common_type_t<T, L, H>;
    if (value < low) return static_cast<Result>(low);
    if (high < value) return static_cast<Result>(high);
    return static_cast<Result>(value);
}
template <typename T>
constexpr auto sq(T value) {
    return value * value;
}
/// The C library has abs() of every signed type; an unsigned value is its own magnitude. As wide
/// as arithmetic makes it: abs() of a byte is an int.
template <typename T>
requires std::is_unsigned_v<T>
constexpr auto abs(T value) { return +value; }

constexpr double radians(double degrees_angle) { return degrees_angle * DEG_TO_RAD; }
constexpr double degrees(double radians_angle) { return radians_angle * RAD_TO_DEG; }

/// Maps `value` from one range to another in whole numbers, rounding towards zero. The result may
/// lie outside the range. An empty source range yields `to_low` (the AVR divides by zero there).
constexpr qduino::arduino::Long map(qduino::arduino::Long value, qduino::arduino::Long from_low,
                                    qduino::arduino::Long from_high, qduino::arduino::Long to_low,
                                    qduino::arduino::Long to_high) {
    if (from_high == from_low) return to_low;
    const std::int64_t place = std::int64_t{value} - from_low;
    const std::int64_t width = std::int64_t{to_high} - to_low;
    return static_cast<qduino::arduino::Long>(place * width / (std::int64_t{from_high} - from_low) + to_low);
}

// ---- random numbers: one sequence for the program, safe from every loop, wait-free --------------
/// Starts the sequence at `seed`; 0 is ignored, as the AVR core does.
void randomSeed(unsigned long seed);
namespace qduino::arduino {
/// A number in [low, high); `low` when the range is empty.
[[nodiscard]] std::int64_t random_between(std::int64_t low, std::int64_t high);
}  // namespace qduino::arduino
/// A number in [low, high); `low` when the range is empty.
inline qduino::arduino::Long random(qduino::arduino::Long low, qduino::arduino::Long high) {
    return static_cast<qduino::arduino::Long>(qduino::arduino::random_between(low, high));
}
/// A number in [0, bound); 0 when bound is not positive.
inline qduino::arduino::Long random(qduino::arduino::Long bound) { return random(0, bound); }

// ---- bits and bytes -----------------------------------------------------------------------------
constexpr qduino::arduino::UnsignedLong bit(unsigned index) {
    return static_cast<qduino::arduino::UnsignedLong>(1ULL << index);
}
/// 0 or 1, of the type that `value >> index` has: of an unsigned long it is one.
template <typename T>
constexpr auto bitRead(const T& value, unsigned index) {
    return (value >> index) & 1;
}
constexpr std::uint8_t lowByte(std::uint64_t value) { return static_cast<std::uint8_t>(value & 0xff); }
constexpr std::uint8_t highByte(std::uint64_t value) {
    return static_cast<std::uint8_t>((value >> 8) & 0xff);
}
constexpr word makeWord(std::uint64_t value) { return static_cast<word>(value); }
constexpr word makeWord(byte high, byte low) { return static_cast<word>((high << 8) | low); }

namespace qduino::arduino {

/// Makes round(x) a whole number, as in Arduino, and leaves std::round(x) the C++ one. The macro
/// hands round() this wrapper. Unqualified, argument-dependent lookup finds the friend; qualified,
/// the wrapper turns back into its value.
template <typename T>
class RoundArgument {
    using Value = std::conditional_t<std::is_integral_v<T>, double, T>;

  public:
    explicit constexpr RoundArgument(T value) : value_(static_cast<Value>(value)) {}
    constexpr operator Value() const { return value_; }  // NOLINT: implicit on purpose
    friend constexpr Long round(RoundArgument argument) {
        return static_cast<Long>(argument.value_ < 0 ? argument.value_ - 0.5 : argument.value_ + 0.5);
    }

  private:
    Value value_;
};

}  // namespace qduino::arduino
