// The sensors of a machine file: each there and back, at its published values, and its faults.
#include "device/temperature_sensor.h"

#include <gtest/gtest.h>

#include <cmath>

namespace qduino::device::temperature_sensor_test {
namespace {

/// Steps in small halves between two temperatures until the resistance fits: slow, and with nothing
/// of Cardano's.
double celsius_by_bisection(const Thermistor& thermistor, double ohm) {
    double low = -60, high = 450;
    while (high - low > 1e-9)
        (thermistor.resistance_ohm(Celsius{(low + high) / 2}) > ohm ? low : high) = (low + high) / 2;
    return (low + high) / 2;
}

TEST(TemperatureSensor, SteinhartHartIsTheLawInBothDirections) {
    constexpr double kA = 0.000722378300319346, kB = 0.000216301852054578, kC = 9.2641025635702e-08;
    const Thermistor thermistor = Thermistor::steinhart_hart(kA, kB, kC);
    for (double ohm = 60; ohm < 1e6; ohm *= 1.3) {
        const double x = std::log(ohm);
        const double celsius = 1 / (kA + kB * x + kC * x * x * x) - 273.15;
        EXPECT_NEAR(thermistor.resistance_ohm(Celsius{celsius}) / ohm, 1, 1e-9) << ohm;
        EXPECT_NEAR(celsius_by_bisection(thermistor, ohm), celsius, 1e-6) << ohm;
        EXPECT_NEAR(thermistor.celsius(ohm / (ohm + 4700))->value(), celsius, 1e-6) << ohm;
    }
}

TEST(TemperatureSensor, WithoutItsThirdTermItIsTheBetaLaw) {
    const SensorSpec beta;
    SensorSpec three = beta;
    three.kind = SensorKind::steinhart_hart;
    for (double celsius = -20; celsius <= 300; celsius += 20) {
        EXPECT_NEAR(TemperatureSensor{three}.fraction(Celsius{celsius}),
                    TemperatureSensor{beta}.fraction(Celsius{celsius}), 1e-4)
            << celsius;
    }
}

/// IEC 60751, table of a PT100, times ten.
TEST(TemperatureSensor, APt1000IsTheTables) {
    const std::pair<double, double> table[]{{0, 1000.00}, {100, 1385.06}, {200, 1758.56}, {300, 2120.52}};
    for (const auto& [celsius, ohm] : table)
        EXPECT_NEAR(Pt1000::resistance_ohm(Celsius{celsius}), ohm, 0.05) << celsius;
    const Pt1000 sensor{2200};
    double before = 0;
    for (double celsius = -40; celsius <= 500; celsius += 5) {
        const double fraction = sensor.fraction(Celsius{celsius});
        EXPECT_NEAR(sensor.celsius(fraction)->value(), celsius, 1e-6);
        EXPECT_GT(fraction, before);
        before = fraction;
    }
}

TEST(TemperatureSensor, APt1000ReadsItsFaults) {
    const TemperatureSensor sensor{SensorSpec{.kind = SensorKind::pt1000}};
    for (const double fraction : {0.0, 0.05, -1.0})
        EXPECT_NE(sensor.celsius(fraction).error().message.view().find("short"), std::string_view::npos);
    for (const double fraction : {1.0, 0.9, std::nan("")})
        EXPECT_NE(sensor.celsius(fraction).error().message.view().find("open"), std::string_view::npos);
}

}  // namespace
}  // namespace qduino::device::temperature_sensor_test
