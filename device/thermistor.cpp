#include "device/thermistor.h"

#include <cmath>

#include "base/contract.h"

namespace qduino::device {
namespace {

constexpr double kZeroCelsiusK = 273.15;

}  // namespace

Thermistor::Thermistor(double r25_ohm, double beta_k, double pull_up_ohm)
    : a_(1.0 / (25.0 + kZeroCelsiusK) - std::log(r25_ohm) / beta_k),
      b_(1.0 / beta_k),
      pull_up_ohm_(pull_up_ohm) {
    QDUINO_EXPECT(r25_ohm > 0 && beta_k > 0);
}

double Thermistor::resistance_ohm(Celsius t) const {
    const double offset = a_ - 1.0 / (t.value() + kZeroCelsiusK);
    return std::exp(-offset / b_);
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
    return Celsius{1.0 / (a_ + b_ * x) - kZeroCelsiusK};
}

}  // namespace qduino::device
