// Physical quantities as types: a length cannot be passed for a speed, nor mm/min for mm/s.
//
// A quantity is a double with exponents of millimetre and second. Products and quotients carry the
// exponents along, so the compiler works out that `MillimetresPerSecond * Seconds` is
// `Millimetres`. Temperature stands apart: it is never multiplied. Only `.value()` gives the raw
// number, so a search for it finds every place where a unit is given up.
#pragma once

#include <compare>
#include <cstdint>

namespace qduino {

/// mm^Length · s^Time, stored as a double.
template <int Length, int Time>
class Quantity {
  public:
    constexpr Quantity() = default;
    explicit constexpr Quantity(double value) : value_(value) {}
    [[nodiscard]] constexpr double value() const { return value_; }

    constexpr auto operator<=>(const Quantity&) const = default;
    constexpr Quantity operator-() const { return Quantity{-value_}; }
    constexpr Quantity& operator+=(Quantity o) { return value_ += o.value_, *this; }
    constexpr Quantity& operator-=(Quantity o) { return value_ -= o.value_, *this; }
    constexpr Quantity& operator*=(double k) { return value_ *= k, *this; }
    friend constexpr Quantity operator+(Quantity a, Quantity b) { return Quantity{a.value_ + b.value_}; }
    friend constexpr Quantity operator-(Quantity a, Quantity b) { return Quantity{a.value_ - b.value_}; }
    friend constexpr Quantity operator*(Quantity a, double k) { return Quantity{a.value_ * k}; }
    friend constexpr Quantity operator*(double k, Quantity a) { return Quantity{a.value_ * k}; }
    friend constexpr Quantity operator/(Quantity a, double k) { return Quantity{a.value_ / k}; }

  private:
    double value_ = 0;
};

/// Products and quotients; dimensionless results are plain doubles.
template <int L1, int T1, int L2, int T2>
constexpr auto operator*(Quantity<L1, T1> a, Quantity<L2, T2> b) {
    if constexpr (L1 + L2 == 0 && T1 + T2 == 0) {
        return a.value() * b.value();
    } else {
        return Quantity<L1 + L2, T1 + T2>{a.value() * b.value()};
    }
}
template <int L1, int T1, int L2, int T2>
constexpr auto operator/(Quantity<L1, T1> a, Quantity<L2, T2> b) {
    if constexpr (L1 == L2 && T1 == T2) {
        return a.value() / b.value();
    } else {
        return Quantity<L1 - L2, T1 - T2>{a.value() / b.value()};
    }
}

using Millimetres = Quantity<1, 0>;
using Seconds = Quantity<0, 1>;
using MillimetresPerSecond = Quantity<1, -1>;
using MillimetresPerSecond2 = Quantity<1, -2>;

/// A temperature in degrees Celsius.
class Celsius {
  public:
    constexpr Celsius() = default;
    explicit constexpr Celsius(double value) : value_(value) {}
    [[nodiscard]] constexpr double value() const { return value_; }
    constexpr auto operator<=>(const Celsius&) const = default;
    /// A difference of temperatures, in kelvin.
    friend constexpr double operator-(Celsius a, Celsius b) { return a.value_ - b.value_; }
    friend constexpr Celsius operator+(Celsius a, double kelvin) { return Celsius{a.value_ + kelvin}; }

  private:
    double value_ = 0;
};

inline namespace literals {
constexpr Millimetres operator""_mm(long double v) { return Millimetres{static_cast<double>(v)}; }
constexpr Millimetres operator""_mm(unsigned long long v) { return Millimetres{static_cast<double>(v)}; }
constexpr MillimetresPerSecond operator""_mm_s(long double v) {
    return MillimetresPerSecond{static_cast<double>(v)};
}
constexpr MillimetresPerSecond operator""_mm_s(unsigned long long v) {
    return MillimetresPerSecond{static_cast<double>(v)};
}
constexpr MillimetresPerSecond2 operator""_mm_s2(long double v) {
    return MillimetresPerSecond2{static_cast<double>(v)};
}
constexpr MillimetresPerSecond2 operator""_mm_s2(unsigned long long v) {
    return MillimetresPerSecond2{static_cast<double>(v)};
}
constexpr Celsius operator""_celsius(long double v) { return Celsius{static_cast<double>(v)}; }
constexpr Celsius operator""_celsius(unsigned long long v) { return Celsius{static_cast<double>(v)}; }
}  // namespace literals

}  // namespace qduino
