// Where an axis may be sent without passing its switch.
//
// The bounds of a machine file may reach behind a switch that can be passed. But an axis that is
// homed from there finds its switch pressed, and no way out of it. So the places that the printer
// chooses by itself lie in front of the switch. Pure.
#pragma once

#include <algorithm>

#include "printer/machine_config.h"

namespace qduino::printer {

struct Reach {
    Millimetres from, to;
};

constexpr Reach before_the_switch(const AxisConfig& axis) {
    if (axis.home_towards_minimum) return {std::max(axis.minimum, axis.home_position), axis.maximum};
    return {axis.minimum, std::min(axis.maximum, axis.home_position)};
}

}  // namespace qduino::printer
