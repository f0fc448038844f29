// Model-based control of one heater: an observer of the block behind the sensor, and the power that
// takes the block to its target.
//
//   reading ──► (−) ──e──► corrects block, sensor, and the model's error ──► duty_towards()
//                ▲                                                                 │
//                └── sensor ◄── after(model): block, sensor, 8 ms further ◄── duty ┘
//                                        ▲ fan, filament flow, room: known, so fed forward
//
// The difficulty is the lag. When the sensor reads the target, the block is above it already, and a
// controller that looks at the sensor overshoots or creeps. The observer knows the block from the
// slope of the readings.
//
// No model is right, so its error is a third state. What it stands for depends on the duty:
//
// - At full power nothing holds, so the readings tell how much the heater gives: the power is
//   corrected (within 0.5…1.6 of its number). Taken for a loss, the same error would stay in the
//   balance when the power goes down to hold, and overshoot.
// - Between off and full power the heater holds: the error is heat from elsewhere, `extra_w`. This
//   is the integral action. It stands still while the duty is at a stop (anti-windup).
//
// Gains: poles of the error at −p, −p and −r, for block and sensor p = 1/max(0.35·lag, 0.45 s), for
// the model's error r = 1/(4·approach). Slower ones overshoot on heaters whose numbers are 20 %
// wrong; quicker ones turn the converter's steps into jumps of the duty. With e = reading − sensor:
//
//   sensor' += l₁e   block' += l₂e   extra' = l₃e      l₁ = 2p + r − 1/lag
//                                                      l₂ = lag·(p² + 2pr),  l₃ = C·lag·p²r
//
// (coefficients of (s + 1/lag + l₁)s² + (l₂/lag)s + l₃/(C·lag), the block's own loss left out:
// Luenberger 1971.) Pure: no clock, no heap. One sample is two exponentials.
#pragma once

#include <optional>

#include "printer/heater_model.h"

namespace qduino::printer::heat {

class ModelControl {
  public:
    explicit ModelControl(const HeaterModel& model) : nominal_(model), model_(model) {}

    struct Sample {
        double celsius = 0;         ///< the reading
        double target_celsius = 0;  ///< 0 or less: off
        double given_duty = 0;      ///< what the heater got since the last sample
        double dt_s = 0.008;        ///< since the last sample, above 0
        double fan_duty = 0;
        double flow_mm3_s = 0;
        double room_celsius = 20;
    };
    /// One sample. Returns the duty, 0…1. It follows the heater also while that is off.
    [[nodiscard]] double update(const Sample& sample);

    /// What the model takes the block's temperature for.
    [[nodiscard]] double block_celsius() const { return state_ ? state_->block_celsius : 0; }
    /// The model's numbers as corrected by the readings.
    [[nodiscard]] const HeaterModel& model() const { return model_; }
    [[nodiscard]] double extra_w() const { return extra_w_; }

  private:
    void correct(const Sample& sample);

    HeaterModel nominal_;  // as it was given
    HeaterModel model_;    // its power corrected
    std::optional<HeaterState> state_;
    double extra_w_ = 0;
};

}  // namespace qduino::printer::heat
