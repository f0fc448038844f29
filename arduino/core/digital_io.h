// Pins: what C++ has of them beyond core/wiring.h.
#pragma once

#include <cstdint>

#include "arduino/core/constants.h"
#include "arduino/core/wiring.h"

namespace qduino::arduino {
/// pinMode(pin, OUTPUT), unless that was the last mode set. `pin` is a pin of the board. For calls
/// that drive a pin which the sketch may not have set up: tone() is one.
void make_output(int pin);
/// The mode last set for `pin`, a pin of the board, is OUTPUT.
[[nodiscard]] bool is_output(int pin);
}  // namespace qduino::arduino

/// The temperature of the processor in °C; NAN, and reported, where the board has no sensor for it.
/// Not real-time: on Linux it opens a file. (As on the RP2040.)
float analogReadTemp();
/// The frequency of analogWrite() on `pin` from now on: 1 Hz to 1 MHz; 0 is the board's own.
/// Setup-time. (Boards with an adjustable PWM have this call. The Uno has not: 490 Hz, and 980 Hz
/// on two pins.)
void analogWriteFrequency(int pin, double frequency_hz);
void analogReadResolution(int bits);   ///< 1…24
void analogWriteResolution(int bits);  ///< 1…24

// C has no default arguments: they are given here.
qduino_unsigned_long pulseIn(int pin, int level, unsigned long timeout_us = 1'000'000);
qduino_unsigned_long pulseInLong(int pin, int level, unsigned long timeout_us = 1'000'000);
/// A square wave of `frequency_hz` (31…65535; 0 is a rest) on `pin` for `duration_ms`, or until
/// noTone(); returns at once. One pin sounds at a time: a second one is ignored while the first
/// sounds, as on the AVR. See core/tone.cpp.
void tone(int pin, unsigned frequency_hz, unsigned long duration_ms = 0);
void noTone(int pin);
