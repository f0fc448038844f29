// Drives a pin by its port's register where there is one to be had, else by digitalWrite().
#pragma once
#include <Arduino.h>

class FastPin {
  public:
    explicit FastPin(int pin) : pin_(pin) { pinMode(pin, OUTPUT); }
    void high();
    const char* way() const;

  private:
    int pin_;
#ifdef portOutputRegister
    volatile uint8_t* port_ = portOutputRegister(digitalPinToPort(pin_));
#endif
};
