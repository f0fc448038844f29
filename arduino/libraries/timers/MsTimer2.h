// MsTimer2: a function that is called every so many milliseconds, under the names of the library
// for the AVR's timer 2. (API of "MsTimer2", playground.arduino.cc/Main/MsTimer2.)
//
// The function runs on loop 29 (periodic_call.h): it may call everything that a loop may.
#pragma once

namespace MsTimer2 {
void set(unsigned long period_ms, void (*function)());
void start();
void stop();
}  // namespace MsTimer2
