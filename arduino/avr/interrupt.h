// The AVR's interrupts in general: cli(), sei() and SREG. An ISR() has no vector here: what it
// would do for a pin does attachInterrupt(), for a timer TimerOne.h.
#pragma once

#include "arduino/Arduino.h"
