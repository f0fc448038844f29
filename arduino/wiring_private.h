/* What an Arduino core keeps for itself, and old libraries use all the same.
 *
 * This file is C and C++. */
#pragma once

#include "arduino/Arduino.h"

#ifndef cbi
#define cbi(place, bit) ((place) &= ~_BV(bit))
#endif
#ifndef sbi
#define sbi(place, bit) ((place) |= _BV(bit))
#endif

#ifdef __cplusplus
extern "C" {
#endif
typedef void (*voidFuncPtr)(void);
#ifdef __cplusplus
}
#endif
