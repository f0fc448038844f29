// A heater in small steps: the same two equations as printer/heater_model.h and twin/heater.h, with
// nothing of either. The oracle of both, and the plant of the controls.
#pragma once

#include <cmath>

namespace qduino::tests {

struct NaiveHeater {
    // What the heater is made of.
    double power_w = 40, heat_capacity_j_k = 22, loss_w_k = 0.09, fan_loss_w_k = 0.0225;
    double sensor_lag_s = 2.5, filament_j_mm3_k = 0.0022, room_celsius = 20;
    // What it has come to now.
    double block_celsius = 20, sensor_celsius = 20;

    /// `seconds` in steps of `step_s` at most, by Heun's rule.
    void advance(double duty, double fan, double flow_mm3_s, double seconds, double step_s = 1e-3) {
        const int steps = static_cast<int>(std::ceil(seconds / step_s));
        const double dt = seconds / steps;
        const double loss = loss_w_k + fan_loss_w_k * fan + filament_j_mm3_k * flow_mm3_s;
        const auto block_slope = [&](double block) {
            return (power_w * duty - loss * (block - room_celsius)) / heat_capacity_j_k;
        };
        const auto sensor_slope = [&](double block, double sensor) {
            return (block - sensor) / sensor_lag_s;
        };
        for (int i = 0; i < steps; ++i) {
            const double b1 = block_slope(block_celsius);
            const double s1 = sensor_slope(block_celsius, sensor_celsius);
            const double b2 = block_slope(block_celsius + b1 * dt);
            const double s2 = sensor_slope(block_celsius + b1 * dt, sensor_celsius + s1 * dt);
            block_celsius += (b1 + b2) / 2 * dt;
            sensor_celsius += (s1 + s2) / 2 * dt;
        }
    }
    /// Full power until the sensor reads `celsius`; `limit_s` at most.
    [[nodiscard]] double full_power_time_s(double celsius, double limit_s = 5000) const {
        NaiveHeater heater = *this;
        double seconds = 0;
        while (heater.sensor_celsius < celsius && seconds < limit_s) {
            heater.advance(1, 0, 0, 1e-3);
            seconds += 1e-3;
        }
        return seconds;
    }
    /// As a 12-bit converter shows it: steps of 0.3 °C near 200 °C, and of 0.05 °C near 60 °C.
    [[nodiscard]] double reading() const {
        const double step = sensor_celsius > 120 ? 0.3 : 0.05;
        return std::round(sensor_celsius / step) * step;
    }
};

}  // namespace qduino::tests
