// The same place in the two vocabularies that meet here: G-code's positions and the motion's
// vectors.
#pragma once

#include "printer/gcode/position.h"
#include "printer/motion/settings.h"

namespace qduino::printer::machine {

constexpr motion::AxisVector to_vector(const gcode::Position& position) {
    motion::AxisVector vector{};
    for (const Axis axis : gcode::kAllAxes) vector[axis] = position[axis].value();
    return vector;
}

constexpr gcode::Position to_position(const motion::AxisVector& vector) {
    gcode::Position position;
    for (const Axis axis : gcode::kAllAxes) position[axis] = Millimetres{vector[axis]};
    return position;
}

}  // namespace qduino::printer::machine
