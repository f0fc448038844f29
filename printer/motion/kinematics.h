// From where the tool is to where the motors are, and back.
//
// The solver asks for the motor positions at both ends of a segment and takes the motors to move in
// proportion in between. That holds for every linear machine. This one is cartesian: motor and axis are the
// same thing here, and also in the planner's limits, in homing, in the player and in the twin, which do not ask
// this file. Another kinematics changes those, too.
#pragma once

#include "printer/motion/settings.h"

namespace qduino::printer::motion {

/// Motor positions, each in mm of its own axis, of a tool position.
constexpr AxisVector motors_from_tool(const AxisVector& tool_mm) { return tool_mm; }

/// And back: where the machine is, by its step counts.
constexpr AxisVector tool_from_motors(const AxisVector& motors_mm) { return motors_mm; }

}  // namespace qduino::printer::motion
