/* avr-libc's busy waits. (avr-libc user manual, <util/delay.h>.)
 *
 * This file is C and C++. */
#pragma once

#include "arduino/core/wiring.h"

/** Spins for `us` µs, fractions of one rounded up: consumes budget. */
static inline void _delay_us(double us) {
    const unsigned long whole = (unsigned long)us;
    delayMicroseconds(whole < us ? whole + 1 : whole);
}
static inline void _delay_ms(double ms) { _delay_us(ms * 1000); }
