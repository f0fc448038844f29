#include "arduino/libraries/LiquidCrystal/LiquidCrystal.h"

#include <algorithm>

#include "arduino/core/digital_io.h"
#include "arduino/core/timing.h"

namespace {

// The data sheet's times, rounded up.
constexpr unsigned long kPowerUpMs = 50;
constexpr unsigned long kWakeUpMs = 5;
constexpr unsigned long kClearMs = 2;
constexpr unsigned long kCommandUs = 40;
constexpr unsigned long kEnableNs = 1000;

constexpr std::uint8_t kClear = 0x01, kHome = 0x02, kEntryMode = 0x04, kDisplayControl = 0x08,
                       kFunctionSet = 0x20, kSetCharacterAddress = 0x40, kSetAddress = 0x80;
constexpr std::uint8_t kEightBits = 0x10, kTwoRows = 0x08;

}  // namespace

LiquidCrystal::LiquidCrystal(int rs, int enable, int d4, int d5, int d6, int d7)
    : LiquidCrystal(rs, kNoPin, enable, d4, d5, d6, d7) {}
LiquidCrystal::LiquidCrystal(int rs, int rw, int enable, int d4, int d5, int d6, int d7)
    : LiquidCrystal(rs, rw, enable, kNoPin, kNoPin, kNoPin, kNoPin, d4, d5, d6, d7) {}
LiquidCrystal::LiquidCrystal(int rs, int enable, int d0, int d1, int d2, int d3, int d4, int d5, int d6,
                             int d7)
    : LiquidCrystal(rs, kNoPin, enable, d0, d1, d2, d3, d4, d5, d6, d7) {}
LiquidCrystal::LiquidCrystal(int rs, int rw, int enable, int d0, int d1, int d2, int d3, int d4, int d5,
                             int d6, int d7)
    : rs_(rs), rw_(rw), enable_(enable), data_{d0, d1, d2, d3, d4, d5, d6, d7} {}

void LiquidCrystal::begin(int columns, int rows, std::uint8_t dots) {
    columns_ = columns;
    rows_ = std::clamp(rows, 1, 4);
    pinMode(rs_, OUTPUT);
    if (rw_ != kNoPin) {
        pinMode(rw_, OUTPUT);
        digitalWrite(rw_, LOW);
    }
    pinMode(enable_, OUTPUT);
    digitalWrite(rs_, LOW);
    digitalWrite(enable_, LOW);
    for (int pin : data_) {
        if (pin != kNoPin) pinMode(pin, OUTPUT);
    }
    const auto width = static_cast<std::uint8_t>(eight_bits() ? kEightBits : 0);
    wake_up(static_cast<std::uint8_t>(kFunctionSet | width | (rows_ > 1 ? kTwoRows : dots)));
    display_ = kDisplayOn;
    set_display(kDisplayOn, true);
    clear();
    entry_ = kIncrement;
    set_entry(kIncrement, true);
}

/// The data sheet's initialisation by instruction (figures 23 and 24): three times "eight bits",
/// which reaches the controller whichever half of a byte it waits for; then, on four bits, "four
/// bits" as a lone half.
void LiquidCrystal::wake_up(std::uint8_t function) {
    delay(kPowerUpMs);
    constexpr std::uint8_t kWake = kFunctionSet | kEightBits;
    for (int i = 0; i < 3; ++i) {
        strobe(eight_bits() ? kWake : kWake >> 4);
        delay(kWakeUpMs);
    }
    if (!eight_bits()) strobe(kFunctionSet >> 4);
    command(function);
}

void LiquidCrystal::clear() {
    command(kClear);
    delay(kClearMs);
}
void LiquidCrystal::home() {
    command(kHome);
    delay(kClearMs);
}

void LiquidCrystal::setCursor(int column, int row) {
    // Rows 0 and 1 begin at 0x00 and 0x40; 2 and 3 go on where those end.
    const int safe_row = std::clamp(row, 0, rows_ - 1);
    const int address = (safe_row % 2) * 0x40 + (safe_row / 2) * columns_ + column;
    command(static_cast<std::uint8_t>(kSetAddress | (address & 0x7f)));
}

void LiquidCrystal::createChar(int location, const std::uint8_t rows[8]) {
    command(static_cast<std::uint8_t>(kSetCharacterAddress | ((location & 7) << 3)));
    for (int i = 0; i < 8; ++i) write(rows[i]);
}

void LiquidCrystal::set_display(std::uint8_t flag, bool on) {
    display_ = static_cast<std::uint8_t>(on ? display_ | flag : display_ & ~flag);
    command(kDisplayControl | display_);
}
void LiquidCrystal::set_entry(std::uint8_t flag, bool on) {
    entry_ = static_cast<std::uint8_t>(on ? entry_ | flag : entry_ & ~flag);
    command(kEntryMode | entry_);
}

std::size_t LiquidCrystal::write(std::uint8_t character) {
    send(character, HIGH);
    return 1;
}

void LiquidCrystal::send(std::uint8_t value, int register_select) {
    digitalWrite(rs_, register_select);
    if (!eight_bits()) strobe(static_cast<std::uint8_t>(value >> 4));
    strobe(eight_bits() ? value : static_cast<std::uint8_t>(value & 0x0f));
    delayMicroseconds(kCommandUs);
}

void LiquidCrystal::strobe(std::uint8_t value) {
    const std::size_t first = eight_bits() ? 0 : 4;
    for (std::size_t i = first; i < data_.size(); ++i) digitalWrite(data_[i], (value >> (i - first)) & 1);
    delayBusyNanoseconds(kEnableNs);
    digitalWrite(enable_, HIGH);
    delayBusyNanoseconds(kEnableNs);
    digitalWrite(enable_, LOW);
    delayBusyNanoseconds(kEnableNs);
}
