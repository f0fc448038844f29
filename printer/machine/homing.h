// Homing, one axis after the other: where the switch presses is where the axis is home.
//
//   speed                      press                                                   press
//     ^   approach, fast         |      retreat            approach at a tenth           |   rest
//     |   ---------------------->|      <------            ------->                      |   60 ms
//     |
//     +--> steps go out until loop 2 sees the switch; it drops the rest of the move, and loop 1 then asks the
//     step counter
//          where the axis really is. The second press, slow, decides; the axis is at home_position by
//          definition.
//
// X and Y before Z, so that the nozzle never comes down beside the bed. Pure: what to do next is returned,
// what happened is passed in.
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

    /// The order has been carried out. `pressed`: the switch ended it. False: an approach came to its end
    /// without the switch; homing is over.
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
