// The AVR's sleep modes. Every mode is idle here: the loop sleeps and consumes no budget, other
// loops run, and it wakes within a millisecond, as by the AVR's own timer.
#pragma once

#include "arduino/Arduino.h"

#define SLEEP_MODE_IDLE 0
#define SLEEP_MODE_ADC 1
#define SLEEP_MODE_PWR_DOWN 2
#define SLEEP_MODE_PWR_SAVE 3
#define SLEEP_MODE_STANDBY 6
#define SLEEP_MODE_EXT_STANDBY 7

inline void set_sleep_mode([[maybe_unused]] int mode) {}
inline void sleep_enable() {}
inline void sleep_disable() {}
inline void sleep_bod_disable() {}
inline void sleep_cpu() { delay(1); }
inline void sleep_mode() { sleep_cpu(); }
