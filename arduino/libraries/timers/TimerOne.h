// TimerOne: a function that is called at a period, and PWM, under the names of the library for the
// AVR's timer 1. (API of "TimerOne", playground.arduino.cc/Code/Timer1.)
//
// The function runs on loop 30 (periodic_call.h): it may call everything that a loop may. PWM
// is the board's.
#pragma once

#include <cstdint>

class TimerOne {
  public:
    void initialize(unsigned long period_us = 1'000'000);
    void setPeriod(unsigned long period_us);
    void attachInterrupt(void (*function)());
    void attachInterrupt(void (*function)(), unsigned long period_us);
    void detachInterrupt();
    void start();
    void stop();
    void restart() { start(); }
    void resume() { start(); }

    /// PWM on `pin` with the timer's period; `duty` is 0 to 1023.
    void pwm(int pin, unsigned duty);
    void pwm(int pin, unsigned duty, unsigned long period_us);
    void setPwmDuty(int pin, unsigned duty);
    void disablePwm(int pin);

  private:
    unsigned long period_us_ = 1'000'000;
    void (*function_)() = nullptr;
};

extern TimerOne Timer1;
