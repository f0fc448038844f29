// The interrupts of a core itself: its alarm, other cores' calls, and how one ends. CoreInterrupts
// is the architecture's: x86/local_apic.h, or aarch64/gic.h.
#pragma once

#include <cstddef>
#include <cstdint>

namespace qduino::board::metal {

inline constexpr std::size_t kCoresMax = 8;

/// Interrupt vectors. 0…31 are the processor's own exceptions.
inline constexpr std::uint8_t kTimerVector = 0x20;
inline constexpr std::uint8_t kSwitchVector = 0x30;  ///< a thread gives the core up
inline constexpr std::uint8_t kCallVector = 0x31;    ///< another core, or this one, left something
inline constexpr std::uint8_t kDeviceVectors = 0x40;
inline constexpr std::uint8_t kSpuriousVector = 0xff;

/// What leads a device's interrupt to a core: a controller with lines, or the device by itself.
class InterruptSource {
  public:
    /// `line` raises `vector` on the core with this target (Core::target()), from now on.
    virtual void route(std::uint8_t line, std::uint8_t vector, std::uint32_t target) = 0;

  protected:
    ~InterruptSource() = default;
};

/// That of the computer's lines; null: it has none, or is not open yet.
inline constinit InterruptSource* interrupt_lines = nullptr;

#ifdef __aarch64__
class Gic;
using CoreInterrupts = Gic;
#else
class LocalApic;
using CoreInterrupts = LocalApic;
#endif

}  // namespace qduino::board::metal

#ifdef __aarch64__
#include "board/metal/aarch64/gic.h"
#else
#include "board/metal/x86/local_apic.h"
#endif
