#include "arduino/libraries/timers/MsTimer2.h"

#include <algorithm>

#include "arduino/libraries/timers/periodic_call.h"

namespace {

constexpr int kTimerLoop = 29;

qduino::arduino::PeriodicCall timer;
qduino::Nanoseconds period{};
void (*called)() = nullptr;

void timer_loop() { timer.serve(); }

const qduino::arduino::TimerRegistration timer_registration{kTimerLoop, &timer_loop, "MsTimer2"};

}  // namespace

void MsTimer2::set(unsigned long period_ms, void (*function)()) {
    period = std::chrono::milliseconds{static_cast<std::int64_t>(std::max(period_ms, 1UL))};
    called = function;
}

void MsTimer2::start() {
    if (called) timer.start(period, called);
}

void MsTimer2::stop() { timer.stop(); }
