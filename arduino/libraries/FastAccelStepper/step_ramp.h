// When a motor's next step is due: speed goes up and down by a constant acceleration, to a target
// that may change at any time.
//
//   v ▲    ______           v_next² = v² ± 2a over one step (v² = v₀² + 2as), and never more than
//     │   ╱      ╲          what still comes to rest at the target: √(2a · steps behind this one).
//     │__╱        ╲___ t    At this acceleration a step takes 2 / (v + v_next)
//
// Arithmetic alone: no clock and no pin.
#pragma once

#include <cstdint>
#include <optional>

namespace qduino::arduino {

class StepRamp {
  public:
    struct Step {
        int direction = 1;   ///< or −1
        double seconds = 0;  ///< from the step before it, or from rest
    };

    /// In steps a second, and in steps a second squared; both > 0.
    void set_speed(double speed) { speed_ = speed; }
    void set_acceleration(double acceleration) { acceleration_ = acceleration; }
    void set_target(std::int64_t target) { target_ = target; }
    /// As far as it needs to come to rest.
    void stop();
    /// At once, where it is.
    void halt();
    /// It is at `position` now, and what is still to go stays.
    void set_position(std::int64_t position);

    /// The next step, which has been taken then. Empty: it rests at its target.
    std::optional<Step> next();

    [[nodiscard]] std::int64_t position() const { return position_; }
    [[nodiscard]] std::int64_t target() const { return target_; }
    /// Signed, in steps a second.
    [[nodiscard]] double velocity() const { return direction_ * velocity_; }
    [[nodiscard]] double speed() const { return speed_; }
    [[nodiscard]] double acceleration() const { return acceleration_; }

  private:
    [[nodiscard]] double next_velocity(double steps_behind) const;
    [[nodiscard]] double duration_to(double after) const;

    double speed_ = 0, acceleration_ = 0;
    std::int64_t position_ = 0, target_ = 0;
    int direction_ = 1;
    double velocity_ = 0;  // in `direction_`, >= 0
};

}  // namespace qduino::arduino
