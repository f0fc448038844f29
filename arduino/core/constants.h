// The words of the Arduino language: levels, modes, bases, pins. Facts of the language reference
// (docs.arduino.cc/language-reference).
//
// They are typed constants, so that a name like LOW stays inside the language. Libraries ask for
// many of them with #ifdef, so those are macros of themselves as well: `#define LOW LOW`. A number
// that libraries compare in #if is a plain macro. C's half is core/c_language.h.
#pragma once

#include <cstdint>

#include "arduino/core/board_pins.h"
#include "arduino/core/sketch_long.h"

using boolean = bool;
using byte = std::uint8_t;
using word = std::uint16_t;
using PinStatus = int;
using BitOrder = int;

namespace qduino::arduino {
using Long = qduino_long;
using UnsignedLong = qduino_unsigned_long;
}  // namespace qduino::arduino

/// For an object of the language: it is made before the objects of a sketch, whose constructors may
/// use it. (GCC: the default priority is 65535.)
#define QDUINO_BEFORE_SKETCH [[gnu::init_priority(1000)]]

inline constexpr int LOW = 0;
inline constexpr int HIGH = 1;
inline constexpr int CHANGE = 2;
inline constexpr int FALLING = 3;
inline constexpr int RISING = 4;
#define LOW LOW
#define HIGH HIGH
#define CHANGE CHANGE
#define FALLING FALLING
#define RISING RISING

inline constexpr int INPUT = 0;
inline constexpr int OUTPUT = 1;
#define INPUT INPUT
#define OUTPUT OUTPUT
#define INPUT_PULLUP 2
#define INPUT_PULLDOWN 3
#define OUTPUT_OPENDRAIN 4

inline constexpr BitOrder LSBFIRST = 0;
inline constexpr BitOrder MSBFIRST = 1;
#define LSBFIRST LSBFIRST
#define MSBFIRST MSBFIRST

inline constexpr int DEC = 10;
inline constexpr int HEX = 16;
inline constexpr int OCT = 8;
inline constexpr int BIN = 2;
#define DEC DEC
#define HEX HEX
#define OCT OCT
#define BIN BIN

inline constexpr double PI = 3.1415926535897932384626433832795;
inline constexpr double HALF_PI = PI / 2;
inline constexpr double TWO_PI = PI * 2;
inline constexpr double DEG_TO_RAD = PI / 180;
inline constexpr double RAD_TO_DEG = 180 / PI;
inline constexpr double EULER = 2.718281828459045235360287471352;
#define PI PI
#define HALF_PI HALF_PI
#define TWO_PI TWO_PI
#define DEG_TO_RAD DEG_TO_RAD
#define RAD_TO_DEG RAD_TO_DEG
#define EULER EULER

// analogReference(): a Linux board's converter has one reference; the others are reported as
// errors.
inline constexpr int DEFAULT = 1;
inline constexpr int EXTERNAL = 0;
inline constexpr int INTERNAL = 3;
inline constexpr int INTERNAL1V1 = 2;
inline constexpr int INTERNAL2V56 = 5;
#define DEFAULT DEFAULT
#define EXTERNAL EXTERNAL
#define INTERNAL INTERNAL
#define INTERNAL1V1 INTERNAL1V1
#define INTERNAL2V56 INTERNAL2V56

inline constexpr std::uint8_t A0 = 54, A1 = 55, A2 = 56, A3 = 57, A4 = 58, A5 = 59, A6 = 60, A7 = 61;
inline constexpr std::uint8_t A8 = 62, A9 = 63, A10 = 64, A11 = 65, A12 = 66, A13 = 67, A14 = 68, A15 = 69;
inline constexpr std::uint8_t SS = PIN_SPI_SS, MOSI = PIN_SPI_MOSI, MISO = PIN_SPI_MISO, SCK = PIN_SPI_SCK;
inline constexpr std::uint8_t SDA = PIN_WIRE_SDA, SCL = PIN_WIRE_SCL;
#define A0 A0
#define A1 A1
#define A2 A2
#define A3 A3
#define A4 A4
#define A5 A5
#define A6 A6
#define A7 A7
#define A8 A8
#define A9 A9
#define A10 A10
#define A11 A11
#define A12 A12
#define A13 A13
#define A14 A14
#define A15 A15
#define SS SS
#define MOSI MOSI
#define MISO MISO
#define SCK SCK
#define SDA SDA
#define SCL SCL
