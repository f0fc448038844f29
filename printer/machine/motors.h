// Which motors are switched on. A motor is switched on before the first step that it must make, and
// off by M84.
//
// Loop 1 only.
#pragma once

#include "printer/gcode/position.h"
#include "printer/motion/settings.h"

namespace qduino::printer::machine {

/// The drivers' ENABLE pins, switched from loop 1 before the first step of an axis and after M84.
class MotorSwitch {
  public:
    virtual ~MotorSwitch() = default;
    virtual void switch_motor(Axis axis, bool on) = 0;
};

class Motors {
  public:
    /// `pins` must outlive the motors.
    explicit Motors(MotorSwitch& pins) : pins_(pins) {}

    void on(Axis axis) { set(axis, true); }
    /// Switches on the motors that are off and have a way to go.
    void on_for(const motion::AxisVector& from, const motion::AxisVector& to) {
        for (const Axis axis : gcode::kAllAxes)
            if (from[axis] != to[axis] && !on_[axis]) on(axis);
    }
    void off(gcode::AxisSet axes) {
        for (const Axis axis : gcode::kAllAxes)
            if (axes.contains(axis)) set(axis, false);
    }

  private:
    void set(Axis axis, bool on) {
        on_[axis] = on;
        pins_.switch_motor(axis, on);
    }

    MotorSwitch& pins_;
    PerAxis<bool> on_{};
};

}  // namespace qduino::printer::machine
