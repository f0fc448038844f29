// The sensors that a machine may have, behind one face: which one, its numbers, and its pull-up.
//
//   SensorSpec (a machine file's [hot_end.sensor]) ─► TemperatureSensor: fraction() ◄─► celsius()
#pragma once

#include <cstdint>
#include <variant>

#include "device/pt1000.h"
#include "device/thermistor.h"

namespace qduino::device {

enum class SensorKind : std::uint8_t { beta, steinhart_hart, pt1000 };

struct SensorSpec {
    SensorKind kind = SensorKind::beta;
    double r25_ohm = kEpcosOhm25;  ///< of a thermistor by its Beta: at 25 °C
    double beta_k = kEpcosBeta;
    /// The coefficients of Steinhart–Hart for a thermistor: they give 1/K from ln of the resistance
    /// in ohms. The defaults are those of the Beta law above.
    double steinhart_a = 5.4046e-4;
    double steinhart_b = 2.4438e-4;
    double steinhart_c = 0;
    double pull_up_ohm = kUsualPullUpOhm;
};

/// Pure arithmetic: may be called from any loop.
class TemperatureSensor {
  public:
    TemperatureSensor() : TemperatureSensor(SensorSpec{}) {}
    explicit TemperatureSensor(const SensorSpec& spec) : sensor_(made(spec)) {}

    /// Share of the reference on the ADC input, 0…1.
    [[nodiscard]] double fraction(Celsius t) const {
        return std::visit([t](const auto& sensor) { return sensor.fraction(t); }, sensor_);
    }
    /// The temperature at `fraction`. Error: faulted, which names the open or short circuit.
    [[nodiscard]] Result<Celsius> celsius(double fraction) const {
        return std::visit([fraction](const auto& sensor) { return sensor.celsius(fraction); }, sensor_);
    }

  private:
    using Any = std::variant<Thermistor, Pt1000>;
    static Any made(const SensorSpec& spec) {
        if (spec.kind == SensorKind::pt1000) return Pt1000{spec.pull_up_ohm};
        if (spec.kind == SensorKind::beta) return Thermistor{spec.r25_ohm, spec.beta_k, spec.pull_up_ohm};
        return Thermistor::steinhart_hart(spec.steinhart_a, spec.steinhart_b, spec.steinhart_c,
                                          spec.pull_up_ohm);
    }

    Any sensor_;
};

}  // namespace qduino::device
