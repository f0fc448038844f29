// Objects at global scope, whose constructors set pins before setup(), as AccelStepper and Stepper
// do; and a name for `unsigned long` that the system has as well, as Keypad declares it.
#pragma once

#include <Arduino.h>

typedef unsigned int uint;
typedef unsigned long ulong;

class GlobalMotor {
  public:
    GlobalMotor(uint8_t first, uint8_t enable);
    /// Steps that are due after `us` microseconds, at one in 4 ms.
    ulong steps(ulong us) const { return us / 4000UL; }
    bool isEnabled() const { return digitalRead(enable_) == HIGH; }

  private:
    uint8_t enable_;
};

class GlobalSwitch {
  public:
    GlobalSwitch(uint8_t pin);
    bool wasPressed() const { return pressed_; }

  private:
    bool pressed_;
};
