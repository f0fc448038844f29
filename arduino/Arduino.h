// Arduino.h: the Arduino language, on this board. Every sketch includes it first (the .ino
// converter adds the line).
//
// The standard headers that declare a word of the language (round is one) come first. Headers that
// a sketch includes after this file see the macros of core/macros.h.
#pragma once

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

#define ARDUINO 10819
#define ARDUINO_QDUINO
#define ARDUINO_ARCH_QDUINO

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
#include "arduino/core/numbers.h"
#include "arduino/core/program_memory.h"
#include "arduino/core/timing.h"

using namespace std::chrono_literals;  // 10us, 5ms: literals only

void setup();
void loop();
/// Called after loop() when Serial has something to read, if the sketch defines it.
void serialEvent();

// Last: it defines the macros of the language.
#include "arduino/QduinoMC.h"
