// The words of the Arduino language: levels, modes, bases, pins. Facts of the language reference
// (docs.arduino.cc/language-reference).
//
// They are typed constants and not macros, so that a name like LOW stays inside the language. Only
// words that sketches test with #ifdef are macros.
#pragma once

#include <cstdint>

using boolean = bool;
using byte = std::uint8_t;
using word = std::uint16_t;
using PinStatus = int;
using BitOrder = int;

inline constexpr int LOW = 0;
inline constexpr int HIGH = 1;
inline constexpr int CHANGE = 2;
inline constexpr int FALLING = 3;
inline constexpr int RISING = 4;

inline constexpr int INPUT = 0;
inline constexpr int OUTPUT = 1;
#define INPUT_PULLUP 2
#define INPUT_PULLDOWN 3
#define OUTPUT_OPENDRAIN 4

inline constexpr BitOrder LSBFIRST = 0;
inline constexpr BitOrder MSBFIRST = 1;

inline constexpr int DEC = 10;
inline constexpr int HEX = 16;
inline constexpr int OCT = 8;
inline constexpr int BIN = 2;

inline constexpr double PI = 3.1415926535897932384626433832795;
inline constexpr double HALF_PI = PI / 2;
inline constexpr double TWO_PI = PI * 2;
inline constexpr double DEG_TO_RAD = PI / 180;
inline constexpr double RAD_TO_DEG = 180 / PI;
inline constexpr double EULER = 2.718281828459045235360287471352;

// analogReference(): a Linux board's converter has one reference; the others are reported as
// errors.
inline constexpr int DEFAULT = 1;
inline constexpr int EXTERNAL = 0;
inline constexpr int INTERNAL = 3;
inline constexpr int INTERNAL1V1 = 2;
inline constexpr int INTERNAL2V56 = 5;

// Pins are numbered as on the Mega: digital 0–53, analog from 54 (A0).
#define LED_BUILTIN 13
inline constexpr std::uint8_t NUM_DIGITAL_PINS = 70;
inline constexpr std::uint8_t NUM_ANALOG_INPUTS = 16;
inline constexpr std::uint8_t A0 = 54, A1 = 55, A2 = 56, A3 = 57, A4 = 58, A5 = 59, A6 = 60, A7 = 61;
inline constexpr std::uint8_t A8 = 62, A9 = 63, A10 = 64, A11 = 65, A12 = 66, A13 = 67, A14 = 68, A15 = 69;
inline constexpr std::uint8_t SS = 53, MOSI = 51, MISO = 50, SCK = 52;
inline constexpr std::uint8_t SDA = 20, SCL = 21;

/// One "cycle" of TIME_UNIT(cycles) and F_CPU is a nanosecond: the seam counts time in those.
#define F_CPU 1000000000UL
constexpr unsigned long clockCyclesPerMicrosecond() { return F_CPU / 1000000UL; }
