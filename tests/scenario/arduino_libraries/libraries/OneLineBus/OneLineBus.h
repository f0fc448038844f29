// Master of a bus of one line: slots that are timed by busy waits, with interrupts held back.
#pragma once
#include <Arduino.h>

class OneLineBus {
  public:
    /// It is run for a global object, before there is a setup().
    explicit OneLineBus(byte pin) : pin_(pin) { pinMode(pin_, INPUT); }
    /// 1: somebody is there.
    byte reset();
    void write(byte value);
    byte read();
    void select(const byte rom[8]);
    void skip() { write(0xCC); }
    /// The next address of the bus; false: there are no more.
    bool search(byte rom[8]);
    void reset_search() { last_branch_ = 64, done_ = false; }
    static byte crc8(const byte* bytes, byte count);

  private:
    void write_bit(byte bit);
    byte read_bit();

    byte pin_;
    byte rom_[8] = {};
    int last_branch_ = 64;
    bool done_ = false;
};
