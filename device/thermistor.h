// NTC thermistor in a voltage divider: temperature to fraction of the reference, and back.
//
//   Vref ──[ pull-up 4.7 kΩ ]──┬──[ thermistor R(T) ]── ground    fraction = R / (R + pull-up)
//                              └── ADC input                      cold: near 1, hot: near 0
//
// R(T), T in kelvin, by the law of Steinhart and Hart (Deep-Sea Research 15, 1968):
//
//   1/T = a + b·ln R + c·(ln R)³
//
// With c = 0 that is the Beta law, R = R25 · exp(B (1/T − 1/298.15)).
//
// Invariants: the fraction falls strictly as the temperature rises; celsius(fraction(t)) == t
// within 1e-6 K, −40…400 °C.
#pragma once

#include "base/quantity.h"
#include "base/result.h"

namespace qduino::device {

/// The 100 kΩ part of most hot ends (EPCOS B57560G104 class): B25/100 of 4092 K.
inline constexpr double kEpcosOhm25 = 100e3;
inline constexpr double kEpcosBeta = 4092;
/// The pull-up of most controller boards.
inline constexpr double kUsualPullUpOhm = 4700;

/// A thermistor and its pull-up. Pure arithmetic: may be called from any loop.
class Thermistor {
  public:
    /// Fractions outside these are not temperatures: the wire is broken, or touches ground.
    static constexpr double kOpenFraction = 0.998;   ///< 2.3 MΩ: −37 °C
    static constexpr double kShortFraction = 0.008;  ///< 38 Ω: above 400 °C

    Thermistor() : Thermistor(kEpcosOhm25, kEpcosBeta) {}
    /// `r25_ohm` > 0 at 25 °C, `beta_k` > 0 in kelvin.
    Thermistor(double r25_ohm, double beta_k, double pull_up_ohm = kUsualPullUpOhm);
    /// The three coefficients of the law; `b` > 0, `c` ≥ 0.
    [[nodiscard]] static Thermistor steinhart_hart(double a, double b, double c,
                                                   double pull_up_ohm = kUsualPullUpOhm);

    /// R(T) in ohms; `t` above −200 °C.
    [[nodiscard]] double resistance_ohm(Celsius t) const;
    /// Share of the reference on the ADC input, 0…1.
    [[nodiscard]] double fraction(Celsius t) const;
    /// The temperature at `fraction`. Error: faulted, which names the open or short circuit, when
    /// this part gives no such fraction.
    [[nodiscard]] Result<Celsius> celsius(double fraction) const;

  private:
    struct Law {
        double a, b, c;
    };
    Thermistor(const Law& law, double pull_up_ohm) : law_(law), pull_up_ohm_(pull_up_ohm) {}

    Law law_;
    double pull_up_ohm_;
};

}  // namespace qduino::device
