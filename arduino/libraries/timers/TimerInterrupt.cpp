#include "arduino/libraries/timers/TimerInterrupt.h"

#include "board/board.h"

bool TimerInterrupt::begin(qduino::Nanoseconds period, Call function, unsigned long duration) {
    if (!function || period.count() <= 0) return false;
    period_ = period;
    function_ = function;
    if (duration > 0 && std::chrono::milliseconds{duration} < period) return false;
    reattachInterrupt(duration);
    return true;
}

void TimerInterrupt::reattachInterrupt(unsigned long duration) {
    if (!function_) return;
    const std::int64_t fit = std::chrono::milliseconds{duration} / period_;
    start(period_, duration > 0 ? fit : qduino::arduino::PeriodicCall::kNoEnd);
}

void TimerInterrupt::start(qduino::Nanoseconds delay, std::int64_t calls) {
    paused_ = false;
    started_ = qduino::board::current().now() + delay - period_;
    calls_.start(period_, function_, delay, calls);
}

void TimerInterrupt::detachInterrupt() {
    paused_ = false;
    calls_.stop();
}

void TimerInterrupt::pauseTimer() {
    if (paused_ || !function_) return;
    paused_ = true;
    to_next_ = period_ - (qduino::board::current().now() - started_) % period_;
    paused_calls_ = calls_.calls_left();
    calls_.stop();
}

void TimerInterrupt::resumeTimer() {
    if (paused_) start(to_next_, paused_calls_);
}
