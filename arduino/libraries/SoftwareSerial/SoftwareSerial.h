// SoftwareSerial (software_serial.h), and the loop that serves it: number 31, which owns core
// 1. A sketch names another core with `#define QDUINO_SOFTWARE_SERIAL_CORE 2` before the #include.
//
// The loop is declared here, and not in the library, so that only a sketch that includes this has
// it.
#pragma once

#include "arduino/core/loops.h"
#include "arduino/libraries/SoftwareSerial/software_serial.h"

#ifndef QDUINO_SOFTWARE_SERIAL_CORE
#define QDUINO_SOFTWARE_SERIAL_CORE 1
#endif

namespace qduino::arduino {
inline const LoopRegistration software_serial_registration{31,
                                                           Nanoseconds{100'000},
                                                           Nanoseconds{100'000},
                                                           QDUINO_SOFTWARE_SERIAL_CORE,
                                                           Nanoseconds{0},
                                                           0,
                                                           &serve_software_serial,
                                                           "SoftwareSerial",
                                                           0};
}  // namespace qduino::arduino
