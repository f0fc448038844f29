// Which motors are switched on. A motor is switched on before the first step that it must make, and
// off by M84, or when nobody has moved it for as long as M84 S said.
//
// Loop 1 only.
#pragma once

#include <algorithm>
#include <optional>

#include "base/time.h"
#include "printer/gcode/position.h"
#include "printer/motion/settings.h"

namespace qduino::printer::machine {

/// The drivers' ENABLE pins, switched from loop 1 before the first step of a motor and after M84.
class MotorSwitch {
  public:
    virtual ~MotorSwitch() = default;
    /// All motors that make the steps of motor `motor`.
    virtual void switch_motor(Axis motor, bool on) = 0;
};

class Motors {
  public:
    /// `pins` must outlive the motors.
    Motors(const Kinematics& kinematics, MotorSwitch& pins) : kinematics_(kinematics), pins_(pins) {}

    /// Those that move the tool along `axis`.
    void on(Axis axis) { set(kinematics_.motors_of(axis), true); }
    /// Switches on the motors that are off and have a way to go.
    void on_for(const motion::AxisVector& from, const motion::AxisVector& to) {
        for (const Axis axis : gcode::kAllAxes)
            if (from[axis] != to[axis]) set(kinematics_.motors_of(axis) & ~on_, true);
    }
    void off(gcode::AxisSet axes) {
        for (const Axis axis : gcode::kAllAxes)
            if (axes.contains(axis)) set(kinematics_.motors_of(axis), false);
    }

    /// 0: never.
    void time_out_after(Nanoseconds idle) { time_out_ = idle; }
    [[nodiscard]] Nanoseconds time_out() const { return time_out_; }
    /// True once, when the motors have been on and idle for so long. `in_use`: something moves, or
    /// may move without being asked again.
    [[nodiscard]] bool timed_out(Instant now, bool in_use) {
        if (in_use || !idle_since_) idle_since_ = now;
        return on_ != 0 && time_out_ > Nanoseconds{0} && now - *idle_since_ >= time_out_;
    }

  private:
    void set(MotorMask motors, bool on) {
        on_ = on ? on_ | motors : on_ & ~motors;
        for (const Axis motor : gcode::kAllAxes)
            if ((motors & motor_bit(motor)) != 0) pins_.switch_motor(motor, on);
    }

    Kinematics kinematics_;
    MotorSwitch& pins_;
    MotorMask on_ = 0;
    Nanoseconds time_out_{0};
    std::optional<Instant> idle_since_;
};

}  // namespace qduino::printer::machine
