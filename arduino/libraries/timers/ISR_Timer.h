// ISR_Timer: sixteen timers that one function serves, which is called every so often: that of a
// TimerInterrupt, or a loop. (API of "TimerInterrupt" 1.8, github.com/khoih-prog/TimerInterrupt.)
//
//   run()    |    |    |    |    |    |        looks which timers are due
//   timer 0  ·····█·········█·········█        late by one call of run() at most; late calls shift
//   timer 1  ··········█··············█        nothing, missed ones are left out
//
// Any loop may call everything here; a timer's function may, too.
#pragma once

#include <array>

#include "arduino/core/lock.h"
#include "arduino/libraries/timers/TimerInterrupt.h"

class ISR_Timer {
  public:
    static constexpr int MAX_TIMERS = 16;
    static constexpr int RUN_FOREVER = 0;
    static constexpr int RUN_ONCE = 1;

    void init();
    void run();

    /// Calls `function` every `interval` ms: for ever, once, or `runs` times (0: for ever), and
    /// then the timer is free again. The timer's number; -1: no function, or all sixteen are used.
    int setInterval(unsigned long interval, timer_callback function);
    int setInterval(unsigned long interval, timer_callback_p function, void* argument);
    int setTimeout(unsigned long interval, timer_callback function);
    int setTimeout(unsigned long interval, timer_callback_p function, void* argument);
    int setTimer(unsigned long interval, timer_callback function, unsigned runs);
    int setTimer(unsigned long interval, timer_callback_p function, void* argument, unsigned runs);

    /// Its next call is one new interval from now. False: there is no such timer.
    bool changeInterval(unsigned timer, unsigned long interval);
    void deleteTimer(unsigned timer);
    /// Its next call is one interval from now.
    void restartTimer(unsigned timer);

    /// One that is not enabled goes on in time, and is not called.
    bool isEnabled(unsigned timer);
    void enable(unsigned timer) { set_enabled(timer, true); }
    void disable(unsigned timer) { set_enabled(timer, false); }
    void enableAll();
    void disableAll();
    void toggle(unsigned timer) { set_enabled(timer, !isEnabled(timer)); }
    unsigned getNumTimers();
    unsigned getNumAvailableTimers() { return MAX_TIMERS - getNumTimers(); }

  private:
    struct Timer {
        qduino::arduino::TimedCall function{};  // none: it is free
        qduino::Nanoseconds interval{};
        qduino::Instant due{};
        unsigned runs = RUN_FOREVER;
        bool enabled = true;
    };
    int add(unsigned long interval, qduino::arduino::TimedCall function, unsigned runs);
    void set_enabled(unsigned timer, bool enabled);
    void set_all(bool enabled);
    [[nodiscard]] bool exists(unsigned timer) const {
        return timer < timers_.size() && timers_[timer].function;
    }

    qduino::arduino::Lock changing_{"ISR_Timer", qduino::runtime::Unsaid::brief};
    std::array<Timer, MAX_TIMERS> timers_{};
};
