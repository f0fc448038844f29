// M306 T: finds the numbers of a heater's model by a step of power, and two rests.
//
//   celsius              ______________________        1 settle   room temperature, off
//   target ............/.|      |      |      |        2 heat     full power, fit
//                    /   |      |      |      |        3 hold     with the fitted model
//              ____/     | rest | hold | fan  |        4 fan      the same with the part fan
//            1     2       3                4
//
// Heat. With full power from rest at the room's temperature, the reading's rise R obeys, once the
// lag has died away (t ≫ lag):
//
//   dR/dt = P/C·(1 − …) − G/C·R        integrated        R(t) = a·t − b·∫R dt − a·lag
//
// with a = P/C, b = G/C. That is linear in a, b and c = a·lag, so three sums of least squares over
// thousands of readings find them, and the converter's steps average out. (Integrating instead of
// differentiating keeps the noise small: the integral-equation approach; e.g. H. Garnier, L. Wang,
// Identification of Continuous-time Models from Sampled Data, 2008.)
//
// Hold. The fitted loss is a small difference of large numbers, so it is measured again where it
// matters: the mean duty that holds the target gives G = (P·duty − C·drift)/(S − T_room).
//
// The heater's power P cannot be found: only P/C and G/C act. It stays as it is given, and so do
// the filament's numbers. Pure; bounded in time.
#pragma once

#include <array>
#include <optional>
#include <string_view>

#include "printer/heat/model_control.h"

namespace qduino::printer::heat {

/// Least squares for R = a·t − b·I − c, from sums alone.
class StepFit {
  public:
    void add(double time_s, double rise, double integral);
    struct Numbers {
        double rate = 0;   ///< a, °C/s
        double loss = 0;   ///< b, 1/s
        double lag_s = 0;  ///< c/a
    };
    /// Nothing: the readings do not tell.
    [[nodiscard]] std::optional<Numbers> solve() const;

  private:
    std::array<std::array<double, 4>, 3> sums_{};
};

class ModelTuning {
  public:
    /// `start`: power and the filament's number are kept. `with_fan`: find what the part fan does.
    ModelTuning(const HeaterModel& start, double target_celsius, bool with_fan);

    struct Output {
        double duty = 0;
        std::optional<double> fan{};  ///< what the part fan must do; nothing: what was asked
        bool heats = false;           ///< the way up has begun: the watch may expect heat
    };
    /// One sample, `dt_s` after the last; `given_duty` is what the heater got since then.
    [[nodiscard]] Output sample(double celsius, double given_duty, double dt_s);
    [[nodiscard]] bool done() const { return phase_ == Phase::done; }
    /// Why it has ended without a result; empty: it has not.
    [[nodiscard]] std::string_view failure() const { return failure_; }
    /// Contract: done().
    [[nodiscard]] const HeaterModel& model() const { return model_; }

  private:
    enum class Phase { settle, heat, rest, hold, fan_rest, fan_hold, done };

    Output settle(double celsius);
    Output heat(double celsius, double dt_s);
    Output hold(double celsius, double given_duty, double dt_s);
    [[nodiscard]] double held_loss_w_k(double celsius) const;
    void end_hold(double celsius);
    void enter(Phase phase);
    void fail(std::string_view why);

    HeaterModel model_;
    double target_;
    bool with_fan_;
    Phase phase_ = Phase::settle;
    std::string_view failure_{};
    double since_s_ = 0;        // in this phase
    double first_celsius_ = 0;  // of this phase, or of the last few seconds at rest
    double at_rest_s_ = 0;
    double room_celsius_ = 0;
    double integral_ = 0;  // of the rise, or of the duty that holds
    double mean_celsius_ = 0;
    StepFit fit_;
    std::optional<ModelControl> control_;
};

}  // namespace qduino::printer::heat
