// Keyboard: this computer as a USB keyboard of another one, as on a Leonardo. (API of Arduino's
// Keyboard library; layout of the United States.)
//
// It needs a device port and a HID gadget on it, which the host sets up: /dev/hidg0, or what
// QDUINO_KEYBOARD names. Without one begin() says so, and keys go nowhere.
#pragma once

#include <array>

#include "arduino/Print.h"

// Keys without a character, as the library numbers them.
#define KEY_LEFT_CTRL 0x80
#define KEY_LEFT_SHIFT 0x81
#define KEY_LEFT_ALT 0x82
#define KEY_LEFT_GUI 0x83
#define KEY_RIGHT_CTRL 0x84
#define KEY_RIGHT_SHIFT 0x85
#define KEY_RIGHT_ALT 0x86
#define KEY_RIGHT_GUI 0x87
#define KEY_RETURN 0xB0
#define KEY_ESC 0xB1
#define KEY_BACKSPACE 0xB2
#define KEY_TAB 0xB3
#define KEY_CAPS_LOCK 0xC1
#define KEY_F1 0xC2
#define KEY_F2 0xC3
#define KEY_F3 0xC4
#define KEY_F4 0xC5
#define KEY_F5 0xC6
#define KEY_F6 0xC7
#define KEY_F7 0xC8
#define KEY_F8 0xC9
#define KEY_F9 0xCA
#define KEY_F10 0xCB
#define KEY_F11 0xCC
#define KEY_F12 0xCD
#define KEY_INSERT 0xD1
#define KEY_HOME 0xD2
#define KEY_PAGE_UP 0xD3
#define KEY_DELETE 0xD4
#define KEY_END 0xD5
#define KEY_PAGE_DOWN 0xD6
#define KEY_RIGHT_ARROW 0xD7
#define KEY_LEFT_ARROW 0xD8
#define KEY_DOWN_ARROW 0xD9
#define KEY_UP_ARROW 0xDA

class Keyboard_ : public Print {
  public:
    /// Setup-time. Reported when there is no such device.
    void begin();
    /// Lets go of all keys.
    void end();
    /// Holds a key: a character, or one of the above. 0: six are held already, or there is no such
    /// key, or the report could not be sent.
    std::size_t press(std::uint8_t key);
    std::size_t release(std::uint8_t key);
    void releaseAll();
    /// Presses and releases.
    std::size_t write(std::uint8_t key) override;
    using Print::write;

  private:
    using Print::release;
    std::size_t send();

    // The boot keyboard's report: modifiers, nothing, and up to six keys.
    std::array<std::uint8_t, 8> report_{};
};

extern Keyboard_ Keyboard;
