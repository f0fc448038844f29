// The local APIC of each core: its timer, its interrupts to other cores, the end of an interrupt.
//
//   registers   in memory (xAPIC), or as model-specific registers (x2APIC) where the processor has
//               them
//   timer       counts down once, or fires at a count of the time-stamp counter (TSC-deadline)
//
// Intel SDM volume 3, chapter 11. Every call is about the core that makes it.
#pragma once

#include <cstdint>

#include "base/time.h"
#include "board/metal/computer/core_interrupts.h"
#include "board/metal/computer/processor.h"

namespace qduino::board::metal {

class LocalApic {
  public:
    /// Once on every core; the first core's call decides about the mode of all. `may_change`: the
    /// processor's better modes are taken. Otherwise it stays an xAPIC, as Linux will want it back.
    static void enable(std::uint64_t address, bool may_change);
    /// Sets the clock, whose counter has this rate, and measures the timer by it. Once, on the
    /// first core, with interrupts off. Takes 20 ms.
    static void calibrate(std::uint64_t hz);
    static std::uint32_t number();
    static void end_of_interrupt(const Frame&) { write(kEndOfInterrupt, 0); }
    /// Interrupts this core once, at `t` or soon after; kForever: not at all. What was set before
    /// is gone. It may come early by what its clock differs, or when `t` is more than a second off.
    static void set_alarm(Instant t);
    static void interrupt_core(std::uint32_t apic, std::uint8_t vector);
    /// INIT, and STARTUP at the page of `trampoline`, which lies below 1 MiB.
    static void start_core(std::uint32_t apic, std::uint32_t trampoline);
    /// An interrupt that cannot be masked, to every other core.
    static void stop_other_cores();

    /// The guarantee report names it by these words.
    static const char* describe() {
        if (x2apic_) return tsc_deadline_ ? "x2APIC, TSC deadline" : "x2APIC, one-shot timer";
        return tsc_deadline_ ? "xAPIC, TSC deadline" : "xAPIC, one-shot timer";
    }

  private:
    static constexpr std::uint32_t kMasked = 0x10000, kDeadlineMode = 0x40000;
    // Registers, by their offset in memory.
    static constexpr std::uint32_t kNumber = 0x20, kTaskPriority = 0x80, kEndOfInterrupt = 0xb0,
                                   kSpurious = 0xf0, kCommand = 0x300, kCommandHigh = 0x310, kTimer = 0x320,
                                   kLint0 = 0x350, kLint1 = 0x360, kCount = 0x380, kCountLeft = 0x390,
                                   kDivider = 0x3e0;

    static std::uint32_t read(std::uint32_t offset);
    static void write(std::uint32_t offset, std::uint32_t value);
    static void command(std::uint32_t apic, std::uint32_t word);
    static void set_timer_mode() {
        write(kTimer, kTimerVector | (tsc_deadline_ ? kDeadlineMode : 0));
        order_stores();  // before the first deadline
    }

    inline static constinit std::uint64_t address_ = 0;
    inline static constinit std::uint64_t timer_hz_ = 0;
    inline static constinit bool x2apic_ = false;
    inline static constinit bool tsc_deadline_ = false;
};

}  // namespace qduino::board::metal
