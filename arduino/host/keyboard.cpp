// Keyboard.h and Mouse.h on gadgets of the host.
#include <algorithm>
#include <string_view>

#include "arduino/host/hid_gadget.h"
#include "arduino/libraries/hid/Keyboard.h"
#include "arduino/libraries/hid/Mouse.h"

using qduino::arduino::host::HidGadget;

Keyboard_ Keyboard QDUINO_BEFORE_SKETCH;
Mouse_ Mouse QDUINO_BEFORE_SKETCH;

namespace {

HidGadget keyboard{"Keyboard.begin", "QDUINO_KEYBOARD", "/dev/hidg0"};
HidGadget mouse{"Mouse.begin", "QDUINO_MOUSE", "/dev/hidg1"};

/// A key, by its place among the usages, and whether Shift goes with it. (USB-IF, HID Usage Tables
/// 1.12, section 10.)
struct Usage {
    std::uint8_t code = 0;  // 0: there is no such key
    std::uint8_t modifiers = 0;
};
constexpr std::uint8_t kShift = 2;
constexpr std::uint8_t kFirstModifier = 0x80, kFirstKey = 0x88;

Usage usage_of(std::uint8_t key) {
    // From usage 4 on: the letters, the digits, and what stands to their right.
    constexpr std::string_view kPlain = "abcdefghijklmnopqrstuvwxyz1234567890\n\x1b\b\t -=[]\\\x01;'`,./";
    constexpr std::string_view kShifted =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZ!@#$%^&*()\x01\x01\x01\x01\x01_+{}|\x01:\"~<>?";
    static_assert(kPlain.size() == kShifted.size());
    if (key >= kFirstKey) return {static_cast<std::uint8_t>(key - kFirstKey), 0};
    if (key >= kFirstModifier) return {0, static_cast<std::uint8_t>(1 << (key - kFirstModifier))};
    if (key <= 1) return {};
    const char wanted = static_cast<char>(key);
    if (const std::size_t at = kPlain.find(wanted); at != std::string_view::npos)
        return {static_cast<std::uint8_t>(4 + at), 0};
    if (const std::size_t at = kShifted.find(wanted); at != std::string_view::npos)
        return {static_cast<std::uint8_t>(4 + at), kShift};
    return {};
}

}  // namespace

// ---- the keyboard -------------------------------------------------------------------------------

void Keyboard_::begin() { keyboard.open(); }

void Keyboard_::end() {
    releaseAll();
    keyboard.close();
}

std::size_t Keyboard_::send() { return keyboard.send(report_) ? 1 : 0; }

std::size_t Keyboard_::press(std::uint8_t key) {
    const Usage usage = usage_of(key);
    if (usage.code == 0 && usage.modifiers == 0) {
        setWriteError();
        return 0;
    }
    const auto first = report_.begin() + 2;
    if (usage.code != 0 && std::find(first, report_.end(), usage.code) == report_.end()) {
        const auto place = std::find(first, report_.end(), std::uint8_t{0});
        if (place == report_.end()) {
            setWriteError();
            return 0;
        }
        *place = usage.code;
    }
    report_[0] = static_cast<std::uint8_t>(report_[0] | usage.modifiers);
    return send();
}

std::size_t Keyboard_::release(std::uint8_t key) {
    const Usage usage = usage_of(key);
    if (usage.code != 0) std::replace(report_.begin() + 2, report_.end(), usage.code, std::uint8_t{0});
    report_[0] = static_cast<std::uint8_t>(report_[0] & ~usage.modifiers);
    return send();
}

void Keyboard_::releaseAll() {
    report_.fill(0);
    send();
}

std::size_t Keyboard_::write(std::uint8_t key) {
    if (key == '\r') return 1;  // of println(): '\n' is the return key
    const std::size_t pressed = press(key);
    if (pressed == 1) release(key);
    return pressed;
}

// ---- the mouse ----------------------------------------------------------------------------------

void Mouse_::begin() { mouse.open(); }

void Mouse_::end() {
    release(MOUSE_LEFT | MOUSE_RIGHT | MOUSE_MIDDLE);
    mouse.close();
}

void Mouse_::move(signed char right, signed char down, signed char wheel) {
    const std::uint8_t report[] = {buttons_, static_cast<std::uint8_t>(right),
                                   static_cast<std::uint8_t>(down), static_cast<std::uint8_t>(wheel)};
    mouse.send(report);
}

void Mouse_::press(std::uint8_t buttons) {
    buttons_ = static_cast<std::uint8_t>(buttons_ | buttons);
    move(0, 0);
}

void Mouse_::release(std::uint8_t buttons) {
    buttons_ = static_cast<std::uint8_t>(buttons_ & ~buttons);
    move(0, 0);
}

void Mouse_::click(std::uint8_t buttons) {
    press(buttons);
    release(buttons);
}
