// Mouse: this computer as a USB mouse of another one, as on a Leonardo. (API of Arduino's Mouse
// library.) The gadget is /dev/hidg1, or what QDUINO_MOUSE names; see Keyboard.h.
#pragma once

#include <cstdint>

#define MOUSE_LEFT 1
#define MOUSE_RIGHT 2
#define MOUSE_MIDDLE 4

class Mouse_ {
  public:
    /// Setup-time. Reported when there is no such device.
    void begin();
    void end();
    void click(std::uint8_t buttons = MOUSE_LEFT);
    /// To the right, down, and up with the wheel.
    void move(signed char right, signed char down, signed char wheel = 0);
    void press(std::uint8_t buttons = MOUSE_LEFT);
    void release(std::uint8_t buttons = MOUSE_LEFT);
    [[nodiscard]] bool isPressed(std::uint8_t buttons = MOUSE_LEFT) const {
        return (buttons_ & buttons) != 0;
    }

  private:
    std::uint8_t buttons_ = 0;
};

extern Mouse_ Mouse;
