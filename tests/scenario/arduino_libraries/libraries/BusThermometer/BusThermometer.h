// Thermometers on a OneLineBus, which has to be found as a library, too.
#pragma once
#include <OneLineBus.h>

class BusThermometer {
  public:
    explicit BusThermometer(OneLineBus* bus) : bus_(bus) {}
    /// All of them measure; waits until they have.
    void request();
    /// Degrees of that one; -127: its bytes came damaged, or not at all.
    float celsius(const byte rom[8]);
    /// 9 to 12 bits, of all.
    void set_resolution(byte bits);

  private:
    OneLineBus* bus_;
};
