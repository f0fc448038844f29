// Homes the axes, one after the other. A stepper motor cannot tell where its axis stands; only the
// switch at the end of the axis can. A fast approach finds the switch soon, and a slow one finds it
// exactly:
//
//   1. approach   towards the switch at `home_speed_mm_s`, until it presses
//   2. retreat    `home_retreat_mm` away from it, at the same speed
//   3. approach   towards it at a tenth of that speed, until it presses again
//   4. settle     rest for `kHomingRest_s`; the axis is then at `home_position_mm`, by definition
//
// Loop 2 looks at the switch before each step of an approach, and sends no more steps of that axis
// once it presses. Loop 1 then has the rest of the move dropped. When the axis has settled, loop
// 2's step count marks the home position. An approach without a press ends the homing as failed.
//
// X and Y are homed before Z, so that the nozzle never comes down beside the bed.
//
// The class is pure: order() says what to do next, and done() is told how it ended.
#pragma once

#include <cstdint>

#include "printer/gcode/position.h"
#include "printer/machine_config.h"

namespace qduino::printer::machine {

inline constexpr double kHomingRest_s = 0.06;

class Homing {
  public:
    enum class Step : std::uint8_t {
        approach,  ///< move `distance_mm` at `speed_mm_s` until the switch presses
        retreat,   ///< move `distance_mm` away
        settle,    ///< rest, then the axis is home
        finished,  ///< all axes are home
    };
    struct Order {
        Step step = Step::finished;
        Axis axis = Axis::x;
        double distance_mm = 0;  ///< signed, machine direction
        double speed_mm_s = 0;
    };

    explicit Homing(const MachineConfig& config) : config_(config) {}

    void begin(gcode::AxisSet axes) {
        left_ = axes;
        phase_ = Phase::fast;
        axis_ = Axis::x;
        active_ = skip_to_wanted_axis();
    }
    [[nodiscard]] bool active() const { return active_; }
    void abandon() { active_ = false; }
    [[nodiscard]] Axis axis() const { return axis_; }
    /// `axis` is among those to be homed and not yet home.
    [[nodiscard]] bool waits_for(Axis axis) const { return active_ && left_.contains(axis) && axis >= axis_; }

    /// What to do now.
    [[nodiscard]] Order order() const {
        if (!active_) return {};
        const AxisConfig& axis = config_.axes[static_cast<std::size_t>(axis_)];
        const double towards = axis.home_towards_minimum ? -1.0 : 1.0;
        const double travel = (axis.maximum - axis.minimum).value() * 1.1 + axis.home_retreat.value();
        switch (phase_) {
            case Phase::fast:
                return {Step::approach, axis_, towards * travel, axis.home_speed.value()};
            case Phase::retreat:
                return {Step::retreat, axis_, -towards * axis.home_retreat.value(), axis.home_speed.value()};
            case Phase::slow:
                return {Step::approach, axis_, towards * 2 * axis.home_retreat.value(),
                        axis.home_speed.value() / 10};
            case Phase::settle:
                break;
        }
        return {Step::settle, axis_, 0, 0};
    }

    /// The order has been carried out. `pressed`: the switch ended it. False: an approach came to
    /// its end without the switch; homing is over.
    [[nodiscard]] bool done(bool pressed) {
        const bool approach = phase_ == Phase::fast || phase_ == Phase::slow;
        if (approach && !pressed) {
            active_ = false;
            return false;
        }
        if (phase_ != Phase::settle) {
            phase_ = static_cast<Phase>(static_cast<int>(phase_) + 1);
            return true;
        }
        phase_ = Phase::fast;
        axis_ = static_cast<Axis>(static_cast<int>(axis_) + 1);
        active_ = skip_to_wanted_axis();
        return true;
    }

  private:
    enum class Phase : std::uint8_t { fast, retreat, slow, settle };

    bool skip_to_wanted_axis() {
        while (axis_ != Axis::e && !left_.contains(axis_))
            axis_ = static_cast<Axis>(static_cast<int>(axis_) + 1);
        return axis_ != Axis::e;
    }

    const MachineConfig& config_;
    gcode::AxisSet left_;
    Axis axis_ = Axis::x;
    Phase phase_ = Phase::fast;
    bool active_ = false;
};

}  // namespace qduino::printer::machine
