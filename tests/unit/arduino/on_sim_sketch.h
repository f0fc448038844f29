// What on_sim_sketch.cpp and its test share.
#pragma once

#include <vector>

#include "arduino/core/serial_port.h"

/// A port that takes 50 µs of CPU time for every byte.
qduino::arduino::SerialPort& slow_port();
extern std::vector<int> received;
extern int chip_selects[2];
extern volatile int wheel_edges;
extern int level_of_wheel_before_setup;
extern int looks_before_setup;
