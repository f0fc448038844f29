// Time, as a sketch sees it. All of it comes from the board's clock, which starts at 0 with the
// program.
//
// millis() and micros() return `unsigned long`, which on a 64-bit Linux has 64 bits: they do not
// wrap, where the AVR's wrap after 49.7 days and 71.6 minutes. The usual `millis() - then >=
// interval` is right on both, provided that `then` is an unsigned long and not a uint32_t.
#pragma once

#include "base/time.h"
#include "board/board.h"

namespace qduino::arduino {
/// Background work while setup() waits, when no loop runs yet that could do it. delay() in setup()
/// calls it with the instant until which it waits; may return before it. Static initialisers only.
void set_setup_work(void (*work)(Instant until));
}  // namespace qduino::arduino

unsigned long millis();
unsigned long micros();
/// Nanoseconds since the program began.
unsigned long long nanos();

/// Sleeps: consumes no budget, other loops run. Never short.
void delay(unsigned long ms);
/// Spins: consumes budget. Never short, and not long either: this is a real busy wait.
void delayMicroseconds(unsigned long us);

// ---- QduinoMC -----------------------------------------------------------------------------------
/// Spins until that much time has passed since the call.
void delayBusyMicroseconds(unsigned long us);
void delayBusyNanoseconds(unsigned long ns);
/// The instant of now, to add to and to give to delayBusyUntil(): a train of pulses without drift.
inline qduino::Instant timeNow() { return qduino::board::current().now(); }
/// Spins until `t`; returns at once when it has passed.
inline void delayBusyUntil(qduino::Instant t) { qduino::board::current().busy_until(t); }
/// The same in nanos().
void delayBusyUntil(unsigned long long t_ns);
/// Sleeps until `t`.
inline void delayUntil(qduino::Instant t) { qduino::board::current().sleep_until(t); }

/// Lets other loops of the same priority run.
void yield();
