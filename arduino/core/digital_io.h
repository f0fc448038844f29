// Pins: digital, analog, PWM, and the language's functions on top of them (shift registers, pulses,
// tones).
//
// A pin number outside the board (128 and above) is reported (core/diagnostics.h) and ignored; a
// read of one gives 0.
#pragma once

#include <cstdint>

#include "arduino/core/constants.h"

namespace qduino::arduino {
/// pinMode(pin, OUTPUT), unless that was the last mode set. `pin` is a pin of the board. For calls
/// that drive a pin which the sketch may not have set up: tone() is one.
void make_output(int pin);
}  // namespace qduino::arduino

// ---- digital ------------------------------------------------------------------------------------
/// Setup-time. `mode`: INPUT, OUTPUT, INPUT_PULLUP, INPUT_PULLDOWN, OUTPUT_OPENDRAIN.
void pinMode(int pin, int mode);
/// LOW is 0, everything else is HIGH. Ends an analogWrite() on the pin. Real-time safe.
void digitalWrite(int pin, int level);
int digitalRead(int pin);

// ---- analog -------------------------------------------------------------------------------------
/// The input as 0 … 2^bits − 1 (10 bits unless analogReadResolution said otherwise). `pin` is A0…
/// or a channel 0–15.
int analogRead(int pin);
/// The temperature of the processor in °C; NAN, and reported, where the board has no sensor for it.
/// Not real-time: on Linux it opens a file. (As on the RP2040.)
float analogReadTemp();
/// PWM with a duty of value / (2^bits − 1), clamped; 8 bits unless analogWriteResolution said
/// otherwise.
void analogWrite(int pin, int value);
/// The frequency of analogWrite() on `pin` from now on: 1 Hz to 1 MHz; 0 is the board's own.
/// Setup-time. (Boards with an adjustable PWM have this call. The Uno has not: 490 Hz, and 980 Hz
/// on two pins.)
void analogWriteFrequency(int pin, double frequency_hz);
/// The board's converter has one reference: DEFAULT is accepted, anything else is reported and
/// changes nothing.
void analogReference(int mode);
void analogReadResolution(int bits);   ///< 1…24
void analogWriteResolution(int bits);  ///< 1…24

// ---- shift registers, pulses, tones -------------------------------------------------------------
void shiftOut(int data_pin, int clock_pin, BitOrder order, std::uint8_t value);
std::uint8_t shiftIn(int data_pin, int clock_pin, BitOrder order);
/// Width in µs of the next whole pulse of `level`; 0 when none began and ended within `timeout_us`.
/// Spins, consuming budget; resolves 1 µs.
unsigned long pulseIn(int pin, int level, unsigned long timeout_us = 1'000'000);
/// The same; on this board one function serves both short and long pulses.
unsigned long pulseInLong(int pin, int level, unsigned long timeout_us = 1'000'000);
/// A square wave of `frequency_hz` (31…65535; 0 is a rest) on `pin` for `duration_ms`, or until
/// noTone(); returns at once. One pin sounds at a time: a second one is ignored while the first
/// sounds, as on the AVR. See core/tone.cpp.
void tone(int pin, unsigned frequency_hz, unsigned long duration_ms = 0);
void noTone(int pin);
