// SREG, the AVR's status register, of which libraries use one bit: whether interrupts are let in.
//
//   uint8_t before = SREG;  cli();  …  SREG = before;
#pragma once

#include <cstdint>

namespace qduino::arduino {

/// The bit of SREG that lets handlers run (I).
inline constexpr std::uint8_t kHandlersRun = 0x80;

/// Reads as kHandlersRun or 0. Written, it holds handlers back, or lets them run.
class StatusRegister {
  public:
    operator std::uint8_t() const;  // NOLINT: implicit, as a register is
    StatusRegister& operator=(std::uint8_t value);
};

}  // namespace qduino::arduino

inline qduino::arduino::StatusRegister SREG;
#define SREG SREG
