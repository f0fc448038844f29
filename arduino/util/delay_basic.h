/* avr-libc's loops of counted clocks, as long as at the 16 MHz of an Uno or Mega. (avr-libc user
 * manual, <util/delay_basic.h>.)
 *
 * This file is C and C++. */
#pragma once

#include "arduino/util/delay.h"

/** Three clocks for each count; 0 is 256. Consumes budget. */
static inline void _delay_loop_1(uint8_t count) { _delay_us((count ? count : 256) * 3 / 16.0); }
/** Four clocks for each count; 0 is 65536. */
static inline void _delay_loop_2(uint16_t count) { _delay_us((count ? count : 65536) * 4 / 16.0); }
