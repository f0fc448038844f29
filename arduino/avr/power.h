/* Parts of an AVR that can be switched off to save current, and its clock's divider. What is off
 * here has no switch: all calls do nothing, and the clock is not divided. (avr-libc user manual,
 * <avr/power.h>.)
 *
 * This file is C and C++. */
#pragma once

#include <stdint.h>

typedef enum {
    clock_div_1 = 0,
    clock_div_2,
    clock_div_4,
    clock_div_8,
    clock_div_16,
    clock_div_32,
    clock_div_64,
    clock_div_128,
    clock_div_256
} clock_div_t;

static inline void clock_prescale_set(clock_div_t divider) { (void)divider; }
static inline clock_div_t clock_prescale_get(void) { return clock_div_1; }

#define QDUINO_NO_SWITCH(part)                        \
    static inline void power_##part##_enable(void) {} \
    static inline void power_##part##_disable(void) {}
QDUINO_NO_SWITCH(all)
QDUINO_NO_SWITCH(adc)
QDUINO_NO_SWITCH(spi)
QDUINO_NO_SWITCH(twi)
QDUINO_NO_SWITCH(timer0)
QDUINO_NO_SWITCH(timer1)
QDUINO_NO_SWITCH(timer2)
QDUINO_NO_SWITCH(timer3)
QDUINO_NO_SWITCH(timer4)
QDUINO_NO_SWITCH(timer5)
QDUINO_NO_SWITCH(usart0)
QDUINO_NO_SWITCH(usart1)
QDUINO_NO_SWITCH(usart2)
QDUINO_NO_SWITCH(usart3)
#undef QDUINO_NO_SWITCH
