// TimerInterrupt: functions that are called at a frequency or an interval, under the names of the
// library for the AVR's timers 1 to 5. (API of "TimerInterrupt" 1.8,
// github.com/khoih-prog/TimerInterrupt.)
//
//   #define USE_TIMER_1 true      ITimer1 exists, and with it loop 28; 27 to 24 are those of the
//   #include <TimerInterrupt.h>   others (periodic_call.h)
//
// The function may call everything that a loop may. An interval is exact: it is no multiple of a
// prescaler. ISR_Timer.h makes sixteen timers of one.
#pragma once

#include <cmath>
#include <cstdint>

#include "arduino/core/constants.h"
#include "arduino/libraries/timers/periodic_call.h"
#include "base/time.h"

#define TIMER_INTERRUPT_VERSION "TimerInterrupt v1.8.0"
#define TIMER_INTERRUPT_VERSION_MAJOR 1
#define TIMER_INTERRUPT_VERSION_MINOR 8
#define TIMER_INTERRUPT_VERSION_PATCH 0
#define TIMER_INTERRUPT_VERSION_INT 1008000

using timer_callback = void (*)();
using timer_callback_p = void (*)(void*);

enum { HW_TIMER_0 = 0, HW_TIMER_1, HW_TIMER_2, HW_TIMER_3, HW_TIMER_4, HW_TIMER_5, NUM_HW_TIMERS };

/// Frequencies in Hz, intervals and durations in ms. A duration of 0 has no end; any other one is
/// as many calls as fit in. False: there is no function, or it would not be called once.
class TimerInterrupt {
  public:
    explicit TimerInterrupt(std::uint8_t timer, qduino::arduino::PeriodicCall& calls)
        : calls_(calls), timer_(static_cast<std::int8_t>(timer)) {}

    void init() { stopTimer(); }
    void init(std::int8_t) { stopTimer(); }

    bool setFrequency(float frequency, timer_callback function, unsigned long duration = 0) {
        return begin(period_of(frequency), Call{function}, duration);
    }
    bool setFrequency(float frequency, timer_callback_p function, std::uint32_t argument,
                      unsigned long duration = 0) {
        void* const pointer = reinterpret_cast<void*>(static_cast<std::uintptr_t>(argument));
        return begin(period_of(frequency), Call{function, pointer}, duration);
    }
    bool attachInterrupt(float frequency, timer_callback function, unsigned long duration = 0) {
        return begin(period_of(frequency), Call{function}, duration);
    }
    template <typename T>
    bool attachInterrupt(float frequency, void (*function)(T), T argument, unsigned long duration = 0) {
        return begin(period_of(frequency), Call{function, argument}, duration);
    }
    bool setInterval(unsigned long interval, timer_callback function, unsigned long duration = 0) {
        return begin(std::chrono::milliseconds{interval}, Call{function}, duration);
    }
    template <typename T>
    bool setInterval(unsigned long interval, void (*function)(T), T argument, unsigned long duration = 0) {
        return begin(std::chrono::milliseconds{interval}, Call{function, argument}, duration);
    }
    bool attachInterruptInterval(unsigned long interval, timer_callback function,
                                 unsigned long duration = 0) {
        return setInterval(interval, function, duration);
    }
    template <typename T>
    bool attachInterruptInterval(unsigned long interval, void (*function)(T), T argument,
                                 unsigned long duration = 0) {
        return setInterval(interval, function, argument, duration);
    }
    void reattachInterrupt(unsigned long duration = 0);
    void enableTimer(unsigned long duration = 0) { reattachInterrupt(duration); }
    void restartTimer(unsigned long duration = 0) { reattachInterrupt(duration); }
    void detachInterrupt();
    void disableTimer() { detachInterrupt(); }
    void stopTimer() { detachInterrupt(); }

    /// The time to the next call is kept, and the calls that are left.
    void pauseTimer();
    void resumeTimer();

    [[nodiscard]] std::int8_t getTimer() const { return timer_; }
    /// Calls that are left; -1: it has no end.
    [[nodiscard]] qduino::arduino::Long getCount() const {
        return static_cast<qduino::arduino::Long>(calls_.calls_left());
    }

  private:
    using Call = qduino::arduino::TimedCall;
    static qduino::Nanoseconds period_of(float frequency) {
        return qduino::Nanoseconds{frequency > 0 ? std::llround(1e9 / static_cast<double>(frequency)) : 0};
    }
    bool begin(qduino::Nanoseconds period, Call function, unsigned long duration);
    void start(qduino::Nanoseconds delay, std::int64_t calls);

    qduino::arduino::PeriodicCall& calls_;
    std::int8_t timer_;
    qduino::Nanoseconds period_{};
    Call function_{};
    qduino::Instant started_{};  // one period before the first call
    qduino::Nanoseconds to_next_{};
    std::int64_t paused_calls_ = 0;
    bool paused_ = false;
};

namespace qduino::arduino {

/// What serves the timer of one number: nothing of it is there unless the sketch asks for it.
template <std::uint8_t Timer>
struct ServedTimer {
    inline static PeriodicCall calls;
    static void serve() { calls.serve(); }
    inline static const char name[] = {'I', 'T', 'i', 'm', 'e', 'r', static_cast<char>('0' + Timer), '\0'};
    TimerRegistration registration{29 - Timer, &serve, name};
    TimerInterrupt timer{Timer, calls};
};

}  // namespace qduino::arduino

#if USE_TIMER_1
inline qduino::arduino::ServedTimer<1> qduino_served_timer_1;
inline TimerInterrupt& ITimer1 = qduino_served_timer_1.timer;
#endif
#if USE_TIMER_2
inline qduino::arduino::ServedTimer<2> qduino_served_timer_2;
inline TimerInterrupt& ITimer2 = qduino_served_timer_2.timer;
#endif
#if USE_TIMER_3
inline qduino::arduino::ServedTimer<3> qduino_served_timer_3;
inline TimerInterrupt& ITimer3 = qduino_served_timer_3.timer;
#endif
#if USE_TIMER_4
inline qduino::arduino::ServedTimer<4> qduino_served_timer_4;
inline TimerInterrupt& ITimer4 = qduino_served_timer_4.timer;
#endif
#if USE_TIMER_5
inline qduino::arduino::ServedTimer<5> qduino_served_timer_5;
inline TimerInterrupt& ITimer5 = qduino_served_timer_5.timer;
#endif
