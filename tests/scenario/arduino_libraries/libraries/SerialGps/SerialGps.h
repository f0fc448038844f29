// Reads sentences from a serial port on any two pins.
#pragma once
#include <Arduino.h>
#include <SoftwareSerial.h>

class SerialGps {
  public:
    SerialGps(int receive, int transmit) : port_(receive, transmit) {}
    void begin(long baud);
    bool ask();
    int read() { return port_.read(); }

  private:
    SoftwareSerial port_;
};
