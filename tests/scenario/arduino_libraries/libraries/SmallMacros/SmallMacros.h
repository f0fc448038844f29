// The small macros and functions that the AVR's core has beside the language.
#pragma once
#include <Arduino.h>
#include <EthernetUdp.h>

#ifndef SERIAL_PORT_HARDWARE
#error "no serial port"
#endif

class SmallMacros {
  public:
    explicit SmallMacros(Stream& out = SERIAL_PORT_HARDWARE) : out_(out) {}
    void say();

  private:
    Stream& out_;
    char packet_[UDP_TX_PACKET_MAX_SIZE];
};
