// QduinoMC: the board's additions to Arduino. Arduino.h includes it; a sketch may include it to
// show that it needs it.
//
//   void loop(id, budget, period [, core]) { … }      core/loops.h      up to 32 loops, each a VCPU
//   TIME_UNIT(us)                                     core/macros.h     unit of their plain numbers
//   waitForNextPeriod()  overrunPolicy()  safeState() core/releases.h
//   promiseProgress(id, limit)  progress()            core/releases.h   what counts as a hang
//   interruptsVcpu()  attachInterruptVcpu()           core/interrupts.h I/O VCPUs
//   noInterrupts(device, core)  noTimer(core)  …      core/interrupts.h isolation of a core
//   delayBusyNanoseconds()  delayBusyUntil()  …       core/timing.h     spins: a length, an instant
//   RingBuffer<T, N>  Channel<T>  Mutex               core/channels.h   between loops
//   Chain                                             core/chain.h      end to end: reaction, age
#pragma once

#include "arduino/core/chain.h"
#include "arduino/core/channels.h"
#include "arduino/core/interrupts.h"
#include "arduino/core/loops.h"
#include "arduino/core/releases.h"
#include "arduino/core/timing.h"

// Last: it defines the macros of the language.
#include "arduino/core/macros.h"
