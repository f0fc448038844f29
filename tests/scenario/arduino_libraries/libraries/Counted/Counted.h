// Functions that timers call: one without an argument, one with a number.
#pragma once
#include <Arduino.h>
#include <TimerInterrupt.hpp>

namespace Counted {
void up();
void once();
void by(unsigned int step);
unsigned ups();
unsigned onces();
unsigned sum();
}  // namespace Counted
