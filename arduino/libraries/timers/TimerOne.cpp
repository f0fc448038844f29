#include "arduino/libraries/timers/TimerOne.h"

#include <algorithm>

#include "arduino/core/diagnostics.h"
#include "arduino/core/digital_io.h"
#include "arduino/libraries/timers/periodic_call.h"
#include "board/board.h"

TimerOne Timer1 QDUINO_BEFORE_SKETCH;

namespace {

namespace board = qduino::board;

constexpr int kTimerLoop = 30;
constexpr unsigned kFullDuty = 1023;

qduino::arduino::PeriodicCall timer;

void timer_loop() { timer.serve(); }

const qduino::arduino::TimerRegistration timer_registration{kTimerLoop, &timer_loop, "Timer1"};

}  // namespace

void TimerOne::initialize(unsigned long period_us) { setPeriod(period_us); }

void TimerOne::setPeriod(unsigned long period_us) {
    period_us_ = std::max(period_us, 1UL);
    start();
}

void TimerOne::attachInterrupt(void (*function)()) {
    function_ = function;
    start();
}

void TimerOne::attachInterrupt(void (*function)(), unsigned long period_us) {
    function_ = function;
    setPeriod(period_us);
}

void TimerOne::detachInterrupt() {
    function_ = nullptr;
    timer.stop();
}

void TimerOne::start() {
    if (function_) timer.start(std::chrono::microseconds{static_cast<std::int64_t>(period_us_)}, function_);
}

void TimerOne::stop() { timer.stop(); }

void TimerOne::pwm(int pin, unsigned duty) {
    analogWriteFrequency(pin, 1e6 / static_cast<double>(period_us_));
    setPwmDuty(pin, duty);
}

void TimerOne::pwm(int pin, unsigned duty, unsigned long period_us) {
    setPeriod(period_us);
    pwm(pin, duty);
}

void TimerOne::setPwmDuty(int pin, unsigned duty) {
    if (pin < 0 || pin >= board::kPinCount) {
        qduino::arduino::refuse("Timer1.pwm", pin, qduino::ErrorCode::invalid_argument, "no such pin");
        return;
    }
    const double share = static_cast<double>(std::min(duty, kFullDuty)) / kFullDuty;
    qduino::arduino::succeeded(
        "Timer1.pwm", pin, board::current().pwm_write(board::PinId{static_cast<std::uint16_t>(pin)}, share));
}

void TimerOne::disablePwm(int pin) { setPwmDuty(pin, 0); }
