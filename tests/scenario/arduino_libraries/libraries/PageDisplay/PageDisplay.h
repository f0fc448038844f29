// A display of 128 by 64 dots with pages of eight rows, over Wire: a picture in memory, which
// display() sends.
#pragma once
#include <Arduino.h>
#include <Wire.h>

class PageDisplay {
  public:
    explicit PageDisplay(TwoWire* wire = &Wire) : wire_(wire) {}
    /// False: nobody answers at this address.
    bool begin(byte address);
    void clear() { memset(dots_, 0, sizeof dots_); }
    void dot(int x, int y);
    void line(int x0, int y0, int x1, int y1);
    void box(int x, int y, int width, int height);
    void circle(int x, int y, int radius);
    void display();
    void invert(bool on) { command(on ? 0xA7 : 0xA6); }

  private:
    void command(byte code);
    void commands(const byte* codes, byte count);

    TwoWire* wire_;
    byte address_ = 0;
    byte dots_[128 * 8] = {};
};
