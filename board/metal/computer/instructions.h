// The instructions that C++ has no word for. Each architecture's header has them under the same
// names: the clock's counter, the interrupt flag, sleep, the way into the kernel, a virtual pin.
#pragma once

#include <cstdint>

#ifdef __aarch64__
#include "board/metal/aarch64/instructions.h"
#else
#include "board/metal/x86/instructions.h"
#endif

namespace qduino::board::metal {

// ---- registers of a device in memory -----------------------------------------------------------

inline void memory_write(std::uint64_t address, std::uint32_t value) {
    *reinterpret_cast<volatile std::uint32_t*>(address) = value;
}
inline std::uint32_t memory_read(std::uint64_t address) {
    return *reinterpret_cast<volatile std::uint32_t*>(address);
}

// ---- interrupts --------------------------------------------------------------------------------

[[noreturn]] inline void halt_forever() {
    disable_interrupts();
    for (;;) halt();
}

/// No interrupt of the calling core while it lives. Nests.
class InterruptsOff {
  public:
    InterruptsOff() : were_enabled_(interrupts_enabled()) { disable_interrupts(); }
    ~InterruptsOff() {
        if (were_enabled_) enable_interrupts();
    }
    InterruptsOff(const InterruptsOff&) = delete;
    InterruptsOff& operator=(const InterruptsOff&) = delete;

  private:
    bool were_enabled_;
};

}  // namespace qduino::board::metal
