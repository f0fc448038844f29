// PID control of one heater.
//
//   output = Kp·e + Ki·∫e dt − Kd·dT/dt        e = target − T
//
// The output is 0…255 inside (Marlin's units) and returned as a duty of 0…1. Textbook PID has three
// troubles here:
//
// - A new target would kick the derivative. So the derivative acts on the temperature, not on the
//   error.
// - The converter is coarse. One step of its 12 bits is about 0.3 °C at 200 °C, which over a sample
//   of 8 ms looks like 37 °C/s. So the derivative goes through a low pass.
// - The integral would wind up on the long way to a target. So it works only near the target (|e| ≤
//   `functional_range`) and is clamped to what full power needs. While the output is saturated, it
//   does not grow further in that direction (conditional integration, Åström & Hägglund).
//
// The gains come from the machine (`HeaterConfig`). Its defaults, 22.2 / 1.08 / 114, are those of
// the reference machine's firmware for its hot end.
#pragma once

#include <algorithm>
#include <cmath>

namespace qduino::printer::heat {

struct PidGains {
    double kp = 0, ki = 0, kd = 0;  ///< output units (0…255) per °C, per °C·s, per °C/s
    double functional_range = 10;   ///< °C: outside, full power or none
    /// Integrate while the output is saturated, too. A bed's integral gain is so small that the
    /// integral must grow while the bed heats up, or it could not hold the temperature. A hot end
    /// would overshoot.
    bool integrate_saturated = false;
    double derivative_filter_s = 3.0;  ///< time constant of the derivative's low pass
};

class Pid {
  public:
    explicit Pid(PidGains gains) : gains_(gains) {}

    /// Forgets the past: call when the target goes from off to on.
    void reset() { *this = Pid{gains_}; }

    /// One sample, `dt_s` > 0 seconds after the last one. Returns the duty, 0 … 1.
    [[nodiscard]] double update(double target_celsius, double celsius, double dt_s) {
        const double error = target_celsius - celsius;
        const double weight = 1.0 - std::exp(-dt_s / gains_.derivative_filter_s);
        const double before = started_ ? smoothed_ : celsius;
        started_ = true;
        smoothed_ = before + weight * (celsius - before);
        const double derivative = (smoothed_ - before) / dt_s;  // °C/s

        if (std::abs(error) > gains_.functional_range) {
            integral_ = 0;
            return error > 0 ? 1.0 : 0.0;
        }
        const double proportional = gains_.kp * error - gains_.kd * derivative;
        const double wanted = proportional + gains_.ki * integral_;
        const bool pushing_out = (wanted > kFull && error > 0) || (wanted < 0 && error < 0);
        if ((gains_.integrate_saturated || !pushing_out) && gains_.ki > 0) {
            integral_ = std::clamp(integral_ + error * dt_s, 0.0, kFull / gains_.ki);
        }
        return std::clamp((proportional + gains_.ki * integral_) / kFull, 0.0, 1.0);
    }

  private:
    static constexpr double kFull = 255.0;
    PidGains gains_;
    bool started_ = false;
    double integral_ = 0;  // °C·s
    double smoothed_ = 0;  // °C, once started
};

}  // namespace qduino::printer::heat
