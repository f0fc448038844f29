// Rule 5 of a heater under model control: what goes in must come out.
//
// The four rules of heater_watch.h look at temperatures alone. A sensor that stands still at the
// target, or reads ever colder while the block gets ever hotter, breaks none of them. But the power
// then no longer fits the temperature. So energy is added up over a window:
//
//   in = ∫ P·duty dt     lost = ∫ G·(S − T_room) dt     stored = C·(S at its end − at its start)
//
//   |in − lost − stored|  ≤  0.2·(in + |lost| + |stored|) + 0.05·P·window
//
// Two windows in a row with the same sign beyond that are a fault. The bound allows each number of
// the model to be 20 % wrong, and the room, the lag and draughts a twentieth of the power. So it is
// coarse: it tells a heater that heats unasked, or one that heats into the void, not a fan that is
// dead. A window is long beside the lag, so that the sensor stands for the block.
//
// A sensor that freezes at its target escapes that for long: the control sums up the hundredth of
// a degree that is missing, and the block gets hotter with every minute. But where nothing changes
// the same temperature needs the same power. So while the reading stays the same to the bit,
// in − lost of each window is compared with the first such window's, whatever the model makes of
// either. Two in a row that are a twentieth of the power away are a fault. A sensor that works
// would have moved by 0.05·P·window/C meanwhile: 1.4 K of the reference hot end, where a step of
// the converter is 0.1 K at 200 °C and 0.5 K at 275 °C.
//
// Pure. Time is a parameter.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

#include "printer/heater_model.h"

namespace qduino::printer::heat {

class HeatBalance {
  public:
    enum class Verdict : std::uint8_t {
        fits,
        too_hot,   ///< more heat than was given: a heater that is stuck on
        too_cold,  ///< less heat than was given: none arrives, or the sensor does not show it
        frozen,    ///< the sensor shows the same, and the power is another one
    };

    explicit HeatBalance(const HeaterModel& model) : model_(model) {}

    /// A window is six lags, and 10 s at least.
    [[nodiscard]] double window_s() const { return std::max(6 * model_.sensor_lag_s, 10.0); }

    /// One sample; `drive.duty` is what the heater got since the last one, `dt_s` (above 0) ago.
    [[nodiscard]] Verdict sample(double celsius, const HeaterDrive& drive, double dt_s) {
        if (elapsed_s_ == 0) start_celsius_ = celsius;
        elapsed_s_ += dt_s;
        same_ = same_ && celsius == last_celsius_;
        last_celsius_ = celsius;
        in_j_ += model_.power_w * drive.duty * dt_s;
        lost_j_ += conductance_w_k(model_, drive) * (celsius - drive.room_celsius) * dt_s;
        if (elapsed_s_ < window_s()) return Verdict::fits;
        const Verdict window = judge(model_.heat_capacity_j_k * (celsius - start_celsius_));
        const bool again = window != Verdict::fits && window == last_;
        last_ = window;
        const bool frozen = stands_still();
        elapsed_s_ = in_j_ = lost_j_ = 0;
        same_ = true;
        if (again) return window;
        return frozen ? Verdict::frozen : Verdict::fits;
    }
    /// Forgets everything: the next sample is the first.
    void reset() { *this = HeatBalance{model_}; }

  private:
    static constexpr double kModelError = 0.2;
    static constexpr double kUnknown = 0.05;

    [[nodiscard]] Verdict judge(double stored_j) const {
        const double missing_j = in_j_ - lost_j_ - stored_j;
        const double allowed_j = kModelError * (in_j_ + std::abs(lost_j_) + std::abs(stored_j)) +
                                 kUnknown * model_.power_w * window_s();
        if (missing_j > allowed_j) return Verdict::too_cold;
        return missing_j < -allowed_j ? Verdict::too_hot : Verdict::fits;
    }

    /// At a window's end: the second in a row with the same reading and another power.
    [[nodiscard]] bool stands_still() {
        const double power_w = (in_j_ - lost_j_) / elapsed_s_;
        if (!same_) {
            still_w_.reset();
        } else if (!still_w_) {
            still_w_ = power_w;
            others_ = 0;
        } else {
            const bool other = std::abs(power_w - *still_w_) > kUnknown * model_.power_w;
            others_ = other ? others_ + 1 : 0;
        }
        return still_w_ && others_ >= 2;
    }

    HeaterModel model_;
    Verdict last_ = Verdict::fits;
    double elapsed_s_ = 0;
    double in_j_ = 0;
    double lost_j_ = 0;
    double start_celsius_ = 0;
    double last_celsius_ = 0;
    bool same_ = false;              ///< no other reading in this window
    std::optional<double> still_w_;  ///< of the first window since the reading last changed
    int others_ = 0;                 ///< windows in a row that differ from it
};

}  // namespace qduino::printer::heat
