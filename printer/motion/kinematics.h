// From the tool's position to the motors': cartesian machines only, where each axis has one motor.
//
// The solver asks for the motor positions at both ends of a segment and takes the motors to move in
// proportion in between. That would hold for every linear machine: CoreXY, say, with (x + y, x −
// y). But this file is not the only place that counts on one motor for each axis: docs/adding.md
// ("A kinematics") lists the others.
#pragma once

#include "printer/motion/settings.h"

namespace qduino::printer::motion {

/// Motor positions, each in mm of its own axis, of a tool position.
constexpr AxisVector motors_from_tool(const AxisVector& tool_mm) { return tool_mm; }

/// The tool's position, of the motors': the machine's place from its step counts.
constexpr AxisVector tool_from_motors(const AxisVector& motors_mm) { return motors_mm; }

}  // namespace qduino::printer::motion
