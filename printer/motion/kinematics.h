// From where the tool is to where the motors are: the one place that knows how the machine is built.
//
// The solver asks for the motor positions at both ends of a segment and takes the motors to move in
// proportion in between. That holds for every linear machine: cartesian here; CoreXY would be (x + y, x − y)
// and nothing else in the project would change. A delta is not linear: it needs a solver of its own behind
// the same events.
#pragma once

#include "printer/motion/settings.h"

namespace qduino::printer::motion {

/// Motor positions, each in mm of its own axis, of a tool position.
constexpr AxisVector motors_from_tool(const AxisVector& tool_mm) { return tool_mm; }

/// And back: for telling where the machine is from its step counts.
constexpr AxisVector tool_from_motors(const AxisVector& motors_mm) { return motors_mm; }

}  // namespace qduino::printer::motion
