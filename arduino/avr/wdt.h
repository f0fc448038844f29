// The AVR's watchdog, as a promise of progress (core/releases.h): a loop that does not reset it in
// time hangs, and the supervisor ends the sketch through its safe states. It waits for a second at
// least, so the shorter times count as one.
#pragma once

#include "arduino/Arduino.h"

#define WDTO_15MS 0
#define WDTO_30MS 1
#define WDTO_60MS 2
#define WDTO_120MS 3
#define WDTO_250MS 4
#define WDTO_500MS 5
#define WDTO_1S 6
#define WDTO_2S 7
#define WDTO_4S 8
#define WDTO_8S 9

namespace qduino::arduino {
/// The calling loop, or in setup() the classic one, resets its watchdog every `limit`; 0: never.
void watch(Nanoseconds limit);
}  // namespace qduino::arduino

/// `timeout` is one of the above: 15 ms, doubled so many times (the AVR's data sheet: 16, 32 … ms).
inline void wdt_enable(int timeout) {
    ::qduino::arduino::watch(
        std::chrono::milliseconds{timeout >= WDTO_1S ? 1000 << (timeout - WDTO_1S) : 16 << timeout});
}
inline void wdt_disable() { ::qduino::arduino::watch(::qduino::Nanoseconds{0}); }
inline void wdt_reset() { progress(); }
