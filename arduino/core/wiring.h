/* The calls of the Arduino language that C has as well: a .c file of a library includes Arduino.h,
 * too. They have C's linkage, so C and C++ call the same function.
 *
 * This file is C and C++. */
#pragma once

#include <stdint.h>

#include "arduino/core/sketch_long.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- pins ---------------------------------------------------------------------------------------
 * A pin number outside the board (128 and above) is reported (core/diagnostics.h) and ignored; a
 * read of one gives 0. */

/** Setup-time. `mode`: INPUT, OUTPUT, INPUT_PULLUP, INPUT_PULLDOWN, OUTPUT_OPENDRAIN. */
void pinMode(int pin, int mode);
/** LOW is 0, everything else is HIGH. Ends an analogWrite() on the pin. Real-time safe. */
void digitalWrite(int pin, int level);
int digitalRead(int pin);

/** The input as 0 … 2^bits − 1 (10 bits unless analogReadResolution said otherwise). `pin` is A0…
 * or a channel 0–15. */
int analogRead(int pin);
/** PWM with a duty of value / (2^bits − 1), clamped; 8 bits unless analogWriteResolution said
 * otherwise. */
void analogWrite(int pin, int value);
/** The board's converter has one reference: DEFAULT is accepted, anything else is reported and
 * changes nothing. */
void analogReference(int mode);

void shiftOut(int data_pin, int clock_pin, int order, uint8_t value);
uint8_t shiftIn(int data_pin, int clock_pin, int order);
/** Width in µs of the next whole pulse of `level`; 0 when none began and ended within `timeout_us`.
 * Spins, consuming budget; resolves 1 µs. */
qduino_unsigned_long pulseIn(int pin, int level, unsigned long timeout_us);
/** The same; on this board one function serves both short and long pulses. */
qduino_unsigned_long pulseInLong(int pin, int level, unsigned long timeout_us);

/* ---- time ------------------------------------------------------------------------------------ */
/** Since the start of the sketch. */
uint64_t qduino_millis(void);
uint64_t qduino_micros(void);
#if defined(QDUINO_LONG_32)
/* Always inline: the library has functions of these names, with 64 bits. */
static inline __attribute__((always_inline)) uint32_t millis(void) { return (uint32_t)qduino_millis(); }
static inline __attribute__((always_inline)) uint32_t micros(void) { return (uint32_t)qduino_micros(); }
#else
unsigned long millis(void);
unsigned long micros(void);
#endif
/** Sleeps: consumes no budget, other loops run. Never short. */
void delay(unsigned long ms);
/** Spins: consumes budget. Never short, and not long either: this is a real busy wait. */
void delayMicroseconds(unsigned long us);
/** Lets other loops of the same priority run. */
void yield(void);

/* ---- interrupts ------------------------------------------------------------------------------ */
/** Runs `handler` on the default I/O VCPU at RISING, FALLING or CHANGE. LOW and HIGH are levels on
 * the AVR; here they mean the edge that leads there. Setup-time. */
void attachInterrupt(int interrupt, void (*handler)(void), int mode);
void detachInterrupt(int interrupt);
/** Holds all handlers back (they run at interrupts()); stops no loop. */
void noInterrupts(void);
void interrupts(void);

#ifdef __cplusplus
}
#endif
