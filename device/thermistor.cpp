#include "device/thermistor.h"

#include <cmath>

#include "base/contract.h"

namespace qduino::device {
namespace {

constexpr double kZeroCelsiusK = 273.15;

}  // namespace

Thermistor::Thermistor(double r25_ohm, double beta_k, double pull_up_ohm)
    : Thermistor({1.0 / (25.0 + kZeroCelsiusK) - std::log(r25_ohm) / beta_k, 1.0 / beta_k, 0}, pull_up_ohm) {
    QDUINO_EXPECT(r25_ohm > 0 && beta_k > 0);
}

Thermistor Thermistor::steinhart_hart(double a, double b, double c, double pull_up_ohm) {
    QDUINO_EXPECT(b > 0 && c >= 0);
    return Thermistor{{a, b, c}, pull_up_ohm};
}

/// The cubic in ln R has one real root, by Cardano's formula; c = 0 leaves a line.
double Thermistor::resistance_ohm(Celsius t) const {
    const double offset = law_.a - 1.0 / (t.value() + kZeroCelsiusK);
    if (law_.c == 0) return std::exp(-offset / law_.b);
    const double half = offset / law_.c / 2;
    const double third = law_.b / law_.c / 3;
    const double root = std::sqrt(half * half + third * third * third);
    return std::exp(std::cbrt(root - half) - std::cbrt(root + half));
}

double Thermistor::fraction(Celsius t) const {
    const double ohm = resistance_ohm(t);
    return ohm / (ohm + pull_up_ohm_);
}

Result<Celsius> Thermistor::celsius(double fraction) const {
    if (!(fraction < kOpenFraction))
        return make_error(ErrorCode::faulted, "thermistor: open circuit; check its wires and plug");
    if (!(fraction > kShortFraction))
        return make_error(ErrorCode::faulted, "thermistor: short circuit; check its wires and insulation");
    const double x = std::log(pull_up_ohm_ * fraction / (1.0 - fraction));
    return Celsius{1.0 / (law_.a + law_.b * x + law_.c * x * x * x) - kZeroCelsiusK};
}

}  // namespace qduino::device
