// PT1000, a platinum resistor, in a voltage divider: temperature to fraction of the reference, and
// back.
//
//   Vref ──[ pull-up ]──┬──[ PT1000 ]── ground    fraction = R / (R + pull-up): small, and it rises
//                       └── ADC input             slowly with the temperature
//
// R = 1000 Ω · (1 + A·t + B·t²), t in °C (IEC 60751; its third term, below 0 °C only, is 0.01 K at
// −40 °C and left out). With 4.7 kΩ a step of 12 bits is about 0.6 K: a smaller pull-up reads
// finer.
//
// Invariants: the fraction rises strictly with the temperature; celsius(fraction(t)) == t within
// 1e-6 K, −50…600 °C.
#pragma once

#include <cmath>

#include "base/quantity.h"
#include "base/result.h"

namespace qduino::device {

class Pt1000 {
  public:
    static constexpr double kOhmAt0 = 1000;
    static constexpr double kA = 3.9083e-3;
    static constexpr double kB = -5.775e-7;
    /// Outside these it is no temperature: a wire is broken, or touches ground.
    static constexpr Celsius kLowest{-50};
    static constexpr Celsius kHighest{600};

    explicit Pt1000(double pull_up_ohm) : pull_up_ohm_(pull_up_ohm) {}

    [[nodiscard]] static double resistance_ohm(Celsius t) {
        return kOhmAt0 * (1 + kA * t.value() + kB * t.value() * t.value());
    }
    /// Share of the reference on the ADC input, 0…1.
    [[nodiscard]] double fraction(Celsius t) const {
        const double ohm = resistance_ohm(t);
        return ohm / (ohm + pull_up_ohm_);
    }
    /// The temperature at `fraction`. Error: faulted, which names the open or short circuit.
    [[nodiscard]] Result<Celsius> celsius(double fraction) const {
        if (!(fraction < this->fraction(kHighest)))
            return make_error(ErrorCode::faulted, "PT1000: open circuit; check its wires and plug");
        if (!(fraction > this->fraction(kLowest)))
            return make_error(ErrorCode::faulted, "PT1000: short circuit; check its wires and insulation");
        const double ratio = pull_up_ohm_ * fraction / (1 - fraction) / kOhmAt0;
        return Celsius{(-kA + std::sqrt(kA * kA - 4 * kB * (1 - ratio))) / (2 * kB)};
    }

  private:
    double pull_up_ohm_;
};

}  // namespace qduino::device
