#include "arduino/libraries/timers/ISR_Timer.h"

#include <algorithm>

#include "base/fixed_vector.h"
#include "board/board.h"

namespace {

using qduino::Instant;
using qduino::Nanoseconds;
using qduino::arduino::LockGuard;
using qduino::arduino::TimedCall;

Instant now() { return qduino::board::current().now(); }

}  // namespace

void ISR_Timer::init() {
    const LockGuard held{changing_};
    timers_.fill({});
}

/// The functions run without the lock, for they may make and delete timers.
void ISR_Timer::run() {
    qduino::FixedVector<TimedCall, MAX_TIMERS> due;
    {
        const LockGuard held{changing_};
        const Instant at = now();
        for (Timer& timer : timers_) {
            if (!timer.function || at < timer.due) continue;
            timer.due += timer.interval * (1 + (at - timer.due) / timer.interval);
            if (!timer.enabled) continue;
            static_cast<void>(due.try_push_back(timer.function));
            if (timer.runs != RUN_FOREVER && --timer.runs == 0) timer = {};
        }
    }
    for (const TimedCall& function : due) function();
}

int ISR_Timer::add(unsigned long interval, TimedCall function, unsigned runs) {
    if (!function) return -1;
    const LockGuard held{changing_};
    const auto place = std::ranges::find_if(timers_, [](const Timer& timer) { return !timer.function; });
    if (place == timers_.end()) return -1;
    const Nanoseconds every = std::chrono::milliseconds{std::max(interval, 1UL)};
    *place = {.function = function, .interval = every, .due = now() + every, .runs = runs, .enabled = true};
    return static_cast<int>(place - timers_.begin());
}

int ISR_Timer::setInterval(unsigned long interval, timer_callback function) {
    return add(interval, TimedCall{function}, RUN_FOREVER);
}
int ISR_Timer::setInterval(unsigned long interval, timer_callback_p function, void* argument) {
    return add(interval, TimedCall{function, argument}, RUN_FOREVER);
}
int ISR_Timer::setTimeout(unsigned long interval, timer_callback function) {
    return add(interval, TimedCall{function}, RUN_ONCE);
}
int ISR_Timer::setTimeout(unsigned long interval, timer_callback_p function, void* argument) {
    return add(interval, TimedCall{function, argument}, RUN_ONCE);
}
int ISR_Timer::setTimer(unsigned long interval, timer_callback function, unsigned runs) {
    return add(interval, TimedCall{function}, runs);
}
int ISR_Timer::setTimer(unsigned long interval, timer_callback_p function, void* argument, unsigned runs) {
    return add(interval, TimedCall{function, argument}, runs);
}

bool ISR_Timer::changeInterval(unsigned timer, unsigned long interval) {
    const LockGuard held{changing_};
    if (!exists(timer)) return false;
    timers_[timer].interval = std::chrono::milliseconds{std::max(interval, 1UL)};
    timers_[timer].due = now() + timers_[timer].interval;
    return true;
}

void ISR_Timer::deleteTimer(unsigned timer) {
    const LockGuard held{changing_};
    if (exists(timer)) timers_[timer] = {};
}

void ISR_Timer::restartTimer(unsigned timer) {
    const LockGuard held{changing_};
    if (exists(timer)) timers_[timer].due = now() + timers_[timer].interval;
}

bool ISR_Timer::isEnabled(unsigned timer) {
    const LockGuard held{changing_};
    return exists(timer) && timers_[timer].enabled;
}

void ISR_Timer::set_enabled(unsigned timer, bool enabled) {
    const LockGuard held{changing_};
    if (exists(timer)) timers_[timer].enabled = enabled;
}

void ISR_Timer::set_all(bool enabled) {
    const LockGuard held{changing_};
    for (Timer& timer : timers_) timer.enabled = enabled;
}

void ISR_Timer::enableAll() { set_all(true); }
void ISR_Timer::disableAll() { set_all(false); }

unsigned ISR_Timer::getNumTimers() {
    const LockGuard held{changing_};
    return static_cast<unsigned>(
        std::ranges::count_if(timers_, [](const Timer& timer) { return static_cast<bool>(timer.function); }));
}
