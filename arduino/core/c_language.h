/* Arduino.h for C: the words and calls of the language that C has. The values are those of
 * core/constants.h, and a test compares them. */
#pragma once

#include "arduino/core/formats.h" /* before the system's headers */

#include <ctype.h>
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "arduino/core/bits.h"
#include "arduino/core/board_pins.h"
#include "arduino/core/libc_of_avr.h"
#include "arduino/core/program_memory.h"
#include "arduino/core/wiring.h"

typedef bool boolean;
typedef uint8_t byte;
typedef uint16_t word;

#define LOW 0
#define HIGH 1
#define CHANGE 2
#define FALLING 3
#define RISING 4
#define INPUT 0
#define OUTPUT 1
#define INPUT_PULLUP 2
#define INPUT_PULLDOWN 3
#define OUTPUT_OPENDRAIN 4
#define LSBFIRST 0
#define MSBFIRST 1
#define DEC 10
#define HEX 16
#define OCT 8
#define BIN 2
#define PI 3.1415926535897932384626433832795
#define HALF_PI (PI / 2)
#define TWO_PI (PI * 2)
#define DEG_TO_RAD (PI / 180)
#define RAD_TO_DEG (180 / PI)
#define EULER 2.718281828459045235360287471352
#define DEFAULT 1
#define EXTERNAL 0
#define INTERNAL 3
#define A0 PIN_A0
#define A1 PIN_A1
#define A2 PIN_A2
#define A3 PIN_A3
#define A4 PIN_A4
#define A5 PIN_A5
#define A6 PIN_A6
#define A7 PIN_A7
#define SS PIN_SPI_SS
#define MOSI PIN_SPI_MOSI
#define MISO PIN_SPI_MISO
#define SCK PIN_SPI_SCK
#define SDA PIN_WIRE_SDA
#define SCL PIN_WIRE_SCL

#ifndef min
#define min(a, b) ((a) < (b) ? (a) : (b))
#endif
#ifndef max
#define max(a, b) ((a) > (b) ? (a) : (b))
#endif
#define constrain(value, low, high) ((value) < (low) ? (low) : (value) > (high) ? (high) : (value))
#define sq(value) ((value) * (value))
#define radians(degrees_angle) ((degrees_angle)*DEG_TO_RAD)
#define degrees(radians_angle) ((radians_angle)*RAD_TO_DEG)
#define bit(index) (1UL << (index))
#define bitRead(value, index) (((value) >> (index)) & 1)
#define lowByte(value) ((uint8_t)((value)&0xff))
#define highByte(value) ((uint8_t)(((value) >> 8) & 0xff))
