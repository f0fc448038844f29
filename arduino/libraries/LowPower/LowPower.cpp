#include "arduino/libraries/LowPower/LowPower.h"

#include <algorithm>
#include <array>

#include "arduino/core/constants.h"
#include "arduino/core/timing.h"
#include "board/board.h"
#include "runtime/runtime.h"

LowPowerClass LowPower QDUINO_BEFORE_SKETCH;

namespace {

using qduino::Instant;
using qduino::Nanoseconds;
using namespace std::chrono_literals;

constexpr Nanoseconds kLook = 1ms;

/// 2^11 to 2^20 cycles of the watchdog's 128 kHz (ATmega328P data sheet, table 10-2). The library's
/// words round them.
constexpr std::array<Nanoseconds, SLEEP_FOREVER> kWatchdog{16ms,  32ms,   64ms,   125ms,  250ms,
                                                           500ms, 1000ms, 2000ms, 4000ms, 8000ms};

std::uint32_t handler_runs() {
    const auto* runtime = qduino::runtime::Runtime::current();
    return runtime ? runtime->handler_runs() : 0;
}

}  // namespace

void LowPowerClass::sleep(period_t period) {
    qduino::board::Board& board = qduino::board::current();
    const std::uint32_t runs = handler_runs();
    const Instant end = period < SLEEP_FOREVER ? board.now() + kWatchdog[period] : qduino::kForever;
    while (!board.stop_requested() && handler_runs() == runs) {
        const Instant now = board.now();
        if (now >= end) return;
        board.note_progress();  // a long sleep is meant: the loop does not hang
        qduino::arduino::wait_until(std::min(end, now + kLook));
    }
}
