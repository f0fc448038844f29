// Time, as a sketch sees it. All of it comes from the board's clock, which starts at 0 with the
// program.
//
// millis() and micros() return `unsigned long`. Where that has the 32 bits of an Arduino
// (QDUINO_LONG_32: tools/ino/as_arduino.py compiles the sketch) they wrap after 49.7 days and 71.6
// minutes, as on an AVR: a difference of two of them is right in any 32-bit type. Elsewhere they
// have 64 bits and never wrap.
#pragma once

#include "arduino/core/wiring.h"
#include "base/time.h"
#include "board/board.h"

namespace qduino::arduino {
/// Background work while setup() waits, when no loop runs yet that could do it: delay() in setup(),
/// and a Stream that waits for a byte there, call it with the instant until which they wait. It may
/// return before. One of each kind; static initialisers, and setup().
void set_setup_work(void (*work)(Instant until));
/// Sleeps until `until`; in setup() the background work is done meanwhile.
void wait_until(Instant until);
}  // namespace qduino::arduino

/// Nanoseconds since the program began.
unsigned long long nanos();

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
