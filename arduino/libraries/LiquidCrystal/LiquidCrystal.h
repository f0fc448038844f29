// LiquidCrystal: a character display with an HD44780 controller, on six pins or more.
//
// The controller takes a byte as two halves on D4–D7 (or whole on D0–D7), each taken over at the
// falling edge of E:
//
//   RS    ══════════════════   command or character, valid throughout
//   D4–7  ══ high ══╳══ low ═
//   E     ▁▁▔▔▁▁▁▁▁▁▁▁▔▔▁▁▁▁   at least 450 ns high
//
// Waits are the data sheet's (Hitachi HD44780U, tables 6 and 12): 37 µs for a command, 1.52 ms to
// clear or home; the short ones spin, the long ones sleep. R/W, if given, is held low: the busy
// flag is not read.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "arduino/Print.h"

// Dot formats for begin().
inline constexpr std::uint8_t LCD_5x8DOTS = 0x00, LCD_5x10DOTS = 0x04;

class LiquidCrystal : public Print {
  public:
    static constexpr int kNoPin = 255;

    LiquidCrystal(int rs, int enable, int d4, int d5, int d6, int d7);
    LiquidCrystal(int rs, int rw, int enable, int d4, int d5, int d6, int d7);
    LiquidCrystal(int rs, int enable, int d0, int d1, int d2, int d3, int d4, int d5, int d6, int d7);
    LiquidCrystal(int rs, int rw, int enable, int d0, int d1, int d2, int d3, int d4, int d5, int d6, int d7);

    /// Setup-time: takes the pins, wakes the controller (50 ms) and clears the display.
    void begin(int columns, int rows, std::uint8_t dots = LCD_5x8DOTS);
    void clear();
    void home();
    void setCursor(int column, int row);
    void display() { set_display(kDisplayOn, true); }
    void noDisplay() { set_display(kDisplayOn, false); }
    void cursor() { set_display(kCursorOn, true); }
    void noCursor() { set_display(kCursorOn, false); }
    void blink() { set_display(kBlinkOn, true); }
    void noBlink() { set_display(kBlinkOn, false); }
    void scrollDisplayLeft() { command(0x18); }
    void scrollDisplayRight() { command(0x1c); }
    void leftToRight() { set_entry(kIncrement, true); }
    void rightToLeft() { set_entry(kIncrement, false); }
    void autoscroll() { set_entry(kShift, true); }
    void noAutoscroll() { set_entry(kShift, false); }
    /// Character 0–7 is these eight rows of five dots.
    void createChar(int location, const std::uint8_t rows[8]);

    std::size_t write(std::uint8_t character) override;
    using Print::write;
    void command(std::uint8_t value) { send(value, LOW); }

  private:
    static constexpr std::uint8_t kDisplayOn = 0x04, kCursorOn = 0x02, kBlinkOn = 0x01;
    static constexpr std::uint8_t kIncrement = 0x02, kShift = 0x01;

    void set_display(std::uint8_t flag, bool on);
    void set_entry(std::uint8_t flag, bool on);
    void wake_up(std::uint8_t function);
    void send(std::uint8_t value, int register_select);
    /// Puts the low bits of `value` on the data pins in use, and strobes E.
    void strobe(std::uint8_t value);
    [[nodiscard]] bool eight_bits() const { return data_[0] != kNoPin; }

    int rs_;
    int rw_;
    int enable_;
    std::array<int, 8> data_;  // D0 … D7; on four bits the first four are kNoPin
    int rows_ = 1;
    int columns_ = 16;
    std::uint8_t display_ = kDisplayOn;
    std::uint8_t entry_ = kIncrement;
};
