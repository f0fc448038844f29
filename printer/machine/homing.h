// Homes the axes, one after the other; a delta's towers all at once. A stepper motor cannot tell
// where its axis stands; only the switch at the end of the axis can. A fast approach finds the
// switch soon, and a slow one finds it exactly:
//
//   fast_approach   towards the switch at `home_speed`, until it presses
//   retreat         `home_retreat` away from it, at the same speed
//   slow_approach   towards it at a tenth of that speed, until it presses again
//   settle          rest for `kHomingRest_s`; the axis is then at `home_position`, by definition
//
// Loop 2 looks at the switch before each step of an approach, and sends no more steps of the motors
// that it ends once it presses (printer/kinematics.h: stopped_by). Loop 1 then has the rest of the
// move dropped. When the axis has settled, loop 2's step counts mark the home position. An approach
// without a press ends the homing as failed.
//
// X and Y are homed before Z, so that the nozzle never comes down beside the bed. On a delta one
// switch alone says nothing of X, Y or Z: the tool goes straight up, which moves all carriages by
// the same, and each stops at its own switch.
//
// The class is pure: order() says what to do next, and done() is told how it ended.
#pragma once

#include <cstdint>

#include "base/contract.h"
#include "printer/gcode/position.h"
#include "printer/kinematics.h"
#include "printer/machine_config.h"

namespace qduino::printer::machine {

inline constexpr double kHomingRest_s = 0.06;

class Homing {
  public:
    enum class Phase : std::uint8_t { fast_approach, retreat, slow_approach, settle };
    struct Order {
        Phase phase = Phase::fast_approach;
        Axis axis = Axis::x;      ///< the tool moves along it
        gcode::AxisSet switches;  ///< all of them must be pressed
        double distance_mm = 0;   ///< signed, machine direction; 0: rest
        double speed_mm_s = 0;

        /// The switch ends it.
        [[nodiscard]] bool approaches() const {
            return phase == Phase::fast_approach || phase == Phase::slow_approach;
        }
    };

    explicit Homing(const MachineConfig& config)
        : config_(config), together_(Kinematics{config}.homes_together()) {}

    void begin(gcode::AxisSet axes) {
        left_ = axes;
        phase_ = Phase::fast_approach;
        axis_ = together_ ? Axis::z : Axis::x;
        active_ = together_ || skip_to_wanted_axis();
    }
    [[nodiscard]] bool active() const { return active_; }
    void abandon() { active_ = false; }

    /// What to do now. Contract: active.
    [[nodiscard]] Order order() const {
        QDUINO_EXPECT(active_);
        const AxisConfig& axis = config_.axes[axis_];
        const double towards = axis.home_towards_minimum ? -1.0 : 1.0;
        const double retreat = axis.home_retreat.value();
        const double speed = axis.home_speed.value();
        const double travel = (axis.maximum - axis.minimum).value() * 1.1 + retreat;
        const gcode::AxisSet switches = together_ ? gcode::AxisSet::tool() : gcode::AxisSet{}.add(axis_);
        switch (phase_) {
            case Phase::fast_approach:
                return {phase_, axis_, switches, towards * travel, speed};
            case Phase::retreat:
                return {phase_, axis_, switches, -towards * retreat, speed};
            case Phase::slow_approach:
                return {phase_, axis_, switches, towards * 2 * retreat, speed / 10};
            case Phase::settle:
                break;
        }
        return {phase_, axis_, switches, 0, 0};
    }

    /// The order has been carried out. `pressed`: the switch ended it. False: an approach came to
    /// its end without the switch; homing is over. Contract: active.
    [[nodiscard]] bool done(bool pressed) {
        if (order().approaches() && !pressed) {
            active_ = false;
            return false;
        }
        if (phase_ != Phase::settle) {
            phase_ = static_cast<Phase>(static_cast<int>(phase_) + 1);
            return true;
        }
        phase_ = Phase::fast_approach;
        axis_ = static_cast<Axis>(static_cast<int>(axis_) + 1);
        active_ = skip_to_wanted_axis();
        return true;
    }

  private:
    bool skip_to_wanted_axis() {
        while (axis_ != Axis::e && !left_.contains(axis_))
            axis_ = static_cast<Axis>(static_cast<int>(axis_) + 1);
        return axis_ != Axis::e;
    }

    const MachineConfig& config_;
    bool together_;
    gcode::AxisSet left_;
    Axis axis_ = Axis::x;
    Phase phase_ = Phase::fast_approach;
    bool active_ = false;
};

}  // namespace qduino::printer::machine
