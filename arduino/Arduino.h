// Arduino.h: the Arduino language, on this board. Every sketch includes it first (the .ino
// converter adds the line).
//
// The standard headers that declare a word of the language (round is one) come first. Headers that
// a sketch includes after this file see the macros of core/macros.h.
//
// A .c file gets C's half of the language (core/c_language.h).
#pragma once

// A build says these on the command line, for a library asks for them before it includes anything.
// Here they are for code that is compiled by hand.
#ifndef ARDUINO
#define ARDUINO 10819
#define ARDUINO_QDUINO 1
#define ARDUINO_ARCH_QDUINO 1
#endif

#ifndef __cplusplus
#include "arduino/core/c_language.h"
#else

#include "arduino/core/formats.h"  // before the system's headers

#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

#include <ctype.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "arduino/HardwareSerial.h"
#include "arduino/Print.h"
#include "arduino/Printable.h"
#include "arduino/Stream.h"
#include "arduino/WCharacter.h"
#include "arduino/WString.h"
#include "arduino/binary.h"
#include "arduino/core/constants.h"
#include "arduino/core/digital_io.h"
#include "arduino/core/interrupts.h"
#include "arduino/core/libc_of_avr.h"
#include "arduino/core/numbers.h"
#include "arduino/core/port_registers.h"
#include "arduino/core/program_memory.h"
#include "arduino/core/status_register.h"
#include "arduino/core/timing.h"

using namespace std::chrono_literals;  // 10us, 5ms: literals only

void setup();
void loop();
/// Called after loop() when Serial has something to read, if the sketch defines it.
void serialEvent();

// Last: it defines the macros of the language.
#include "arduino/QduinoMC.h"

#endif
