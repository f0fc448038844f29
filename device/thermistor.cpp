#include "device/thermistor.h"

#include <cmath>

#include "base/contract.h"

namespace qduino::device {
namespace {

constexpr double kZeroCelsiusK = 273.15;

}  // namespace

SteinhartHart from_beta(double r25_ohm, double beta_k) {
    QDUINO_EXPECT(r25_ohm > 0 && beta_k > 0);
    return {1.0 / (25.0 + kZeroCelsiusK) - std::log(r25_ohm) / beta_k, 1.0 / beta_k, 0.0};
}

// Newton's divided differences of y = 1/T in x = ln R for the basis 1, x, x³.
Result<SteinhartHart> from_points(const std::array<ResistancePoint, 3>& points) {
    std::array<double, 3> x{};
    std::array<double, 3> y{};
    for (std::size_t i = 0; i < 3; ++i) {
        if (!(points[i].ohm > 0) || !(points[i].celsius > -kZeroCelsiusK))
            return make_error(ErrorCode::invalid_argument,
                              "thermistor: a point has no resistance or no temperature");
        x[i] = std::log(points[i].ohm);
        y[i] = 1.0 / (points[i].celsius + kZeroCelsiusK);
    }
    if (x[0] == x[1] || x[1] == x[2] || x[0] == x[2])
        return make_error(ErrorCode::invalid_argument, "thermistor: two points have the same resistance");
    const double slope01 = (y[1] - y[0]) / (x[1] - x[0]);
    const double slope02 = (y[2] - y[0]) / (x[2] - x[0]);
    // (x1³ − x0³)/(x1 − x0) = x1² + x1 x0 + x0²
    const double cubic01 = x[1] * x[1] + x[1] * x[0] + x[0] * x[0];
    const double cubic02 = x[2] * x[2] + x[2] * x[0] + x[0] * x[0];
    SteinhartHart curve;
    curve.c = (slope02 - slope01) / (cubic02 - cubic01);
    curve.b = slope01 - curve.c * cubic01;
    curve.a = y[0] - curve.b * x[0] - curve.c * x[0] * x[0] * x[0];
    if (!(curve.b > 0) || !(curve.c >= 0))
        return make_error(
            ErrorCode::invalid_argument,
            "thermistor: the three points lie on no falling curve; check their order and units");
    return curve;
}

// Solves c x³ + b x + (a − 1/T) = 0 for x = ln R.
double Thermistor::resistance_ohm(Celsius t) const {
    const double offset = curve_.a - 1.0 / (t.value() + kZeroCelsiusK);
    double x = -offset / curve_.b;
    if (curve_.c > 0) {
        const double p = curve_.b / (3.0 * curve_.c);
        const double q = offset / (2.0 * curve_.c);
        const double root = std::sqrt(q * q + p * p * p);
        x = std::cbrt(-q + root) + std::cbrt(-q - root);
        // Cardano's two terms nearly cancel when c is small: one Newton step gives the digits back.
        x -= (curve_.c * x * x * x + curve_.b * x + offset) / (3.0 * curve_.c * x * x + curve_.b);
    }
    return std::exp(x);
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
    return Celsius{1.0 / (curve_.a + curve_.b * x + curve_.c * x * x * x) - kZeroCelsiusK};
}

}  // namespace qduino::device
