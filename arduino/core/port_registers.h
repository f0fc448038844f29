// The AVR's port registers, PORTB and its like, over this board's pins.
//
//   PORTB |= _BV(7);      pin 13 high, if it is an output; else its pull-up on
//   DDRB &= ~_BV(7);      pin 13 is an input
//   PINB & _BV(4)         pin 10 reads high
//   PINB = _BV(7);        toggles pin 13
//
// A register is an object and no memory: each bit that an operation names goes through the board,
// as digitalWrite() does. So a library that takes the address of a register for a `volatile
// uint8_t*` does not compile, rather than write to memory that moves no pin; one that asks with
// #ifdef for portOutputRegister is told no, and takes its way by digitalWrite().
//
// Bit and pin go together as on the Mega (ATmega2560 data sheet, and the Mega's pinout).
#pragma once

#include <cstdint>

#include "arduino/core/constants.h"
#include "arduino/core/port_bits.h"

namespace qduino::arduino {

enum class RegisterKind : std::uint8_t { output, direction, input };

class PortRegister {
  public:
    constexpr PortRegister(char port, RegisterKind kind) : port_(port), kind_(kind) {}

    operator std::uint8_t() const { return read(); }  // NOLINT: implicit, as a register is
    /// Bits that keep their value change nothing.
    PortRegister& operator=(std::uint8_t value) { return write(0xff, value); }
    PortRegister& operator|=(int bits) { return write(static_cast<std::uint8_t>(bits), 0xff); }
    PortRegister& operator&=(int bits) { return write(static_cast<std::uint8_t>(~bits), 0); }
    PortRegister& operator^=(int bits) {
        return write(static_cast<std::uint8_t>(bits), static_cast<std::uint8_t>(~read()));
    }
    PortRegister(const PortRegister&) = delete;
    PortRegister& operator=(const PortRegister& other) { return *this = other.read(); }

  private:
    [[nodiscard]] std::uint8_t read() const;
    /// The bits of `mask` take their value from `value`.
    PortRegister& write(std::uint8_t mask, std::uint8_t value);

    char port_;
    RegisterKind kind_;
};

/// 'B' for pin 13; 0: a pin without a port.
[[nodiscard]] char port_of(int pin);
/// The bit of pin 13 in PORTB, 0x80; 0: a pin without a port.
[[nodiscard]] std::uint8_t bit_of(int pin);
[[nodiscard]] PortRegister& port_register(char port, RegisterKind kind);

}  // namespace qduino::arduino

#define QDUINO_PORT(letter)                                                                                 \
    inline qduino::arduino::PortRegister PORT##letter{#letter[0], qduino::arduino::RegisterKind::output};   \
    inline qduino::arduino::PortRegister DDR##letter{#letter[0], qduino::arduino::RegisterKind::direction}; \
    inline qduino::arduino::PortRegister PIN##letter { #letter[0], qduino::arduino::RegisterKind::input }
QDUINO_PORT(A);
QDUINO_PORT(B);
QDUINO_PORT(C);
QDUINO_PORT(D);
QDUINO_PORT(E);
QDUINO_PORT(F);
QDUINO_PORT(G);
QDUINO_PORT(H);
QDUINO_PORT(J);
QDUINO_PORT(K);
QDUINO_PORT(L);
#undef QDUINO_PORT

inline std::uint8_t digitalPinToPort(int pin) {
    return static_cast<std::uint8_t>(qduino::arduino::port_of(pin));
}
inline std::uint8_t digitalPinToBitMask(int pin) { return qduino::arduino::bit_of(pin); }
inline qduino::arduino::PortRegister* portOutputRegister(int port) {
    return &qduino::arduino::port_register(static_cast<char>(port), qduino::arduino::RegisterKind::output);
}
inline qduino::arduino::PortRegister* portInputRegister(int port) {
    return &qduino::arduino::port_register(static_cast<char>(port), qduino::arduino::RegisterKind::input);
}
inline qduino::arduino::PortRegister* portModeRegister(int port) {
    return &qduino::arduino::port_register(static_cast<char>(port), qduino::arduino::RegisterKind::direction);
}
