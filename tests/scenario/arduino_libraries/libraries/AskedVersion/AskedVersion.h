// A library of 2011: it asks for the Arduino version before it includes anything.
#pragma once

#if ARDUINO >= 100
#include "Arduino.h"
#else
#include "WProgram.h"
#endif

class AskedVersion {
  public:
    unsigned long now();
};
