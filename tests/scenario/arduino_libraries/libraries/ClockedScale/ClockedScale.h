// Reads a load cell's converter that is clocked out bit by bit: 24 bits, two's complement.
#pragma once
#include <Arduino.h>

class ClockedScale {
  public:
    /// `gain`: 128 or 64 of input A, 32 of input B.
    void begin(byte data, byte clock, byte gain = 128);
    bool is_ready() { return digitalRead(data_) == LOW; }
    void wait_ready() {
        while (!is_ready()) delay(1);
    }
    /// Holds from the next reading but one on.
    void set_gain(byte gain);
    long read();
    long read_average(byte times = 10);
    void tare(byte times = 10) { offset_ = read_average(times); }
    void set_scale(float steps) { scale_ = steps; }
    float get_units(byte times = 1) { return (read_average(times) - offset_) / scale_; }
    void power_down();
    void power_up() { digitalWrite(clock_, LOW); }

  private:
    byte data_ = 0, clock_ = 0, pulses_ = 1;
    long offset_ = 0;
    float scale_ = 1;
};
