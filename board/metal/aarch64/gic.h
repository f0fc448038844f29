// The interrupt controller and the timer of each core.
//
//   device ─► distributor: which core? ─┐
//   core ─► distributor: SGI            ├─► CPU interface ─► IRQ; the order to stop ─► FIQ
//   the core's own timer: PPI ──────────┘                    (InterruptsOff masks IRQ alone)
//
// Arm Generic Interrupt Controller, architecture version 2.0 (IHI 0048B): chapter 4 (registers),
// 2.2 (numbers). The generic timer: Arm ARM (DDI 0487), D12.2; the virtual one, whose interrupt is
// PPI 27 by the Base System Architecture (DEN0094). Every call is about the core that makes it.
#pragma once

#include <array>
#include <cstdint>

#include "base/time.h"
#include "board/metal/computer/core_interrupts.h"
#include "board/metal/computer/processor.h"

namespace qduino::board::metal {

class Gic {
  public:
    /// The addresses are those of the registers. There is one distributor; each core sees its own
    /// CPU interface at the same place. The first core calls it, once.
    static void open(std::uint64_t distributor, std::uint64_t cpu_interface);
    /// Once on every core.
    static void enable();
    /// The CPU interface of the calling core, 0 to 7.
    static std::uint32_t number();

    /// What interrupted, into `frame`: its vector, and the word that end_of_interrupt() gives back.
    static void acknowledge(Frame& frame);
    static void end_of_interrupt(const Frame& frame);
    /// Interrupts this core once, at `t` or soon after; kForever: not at all. What was set before
    /// is gone.
    static void set_alarm(Instant t);
    static void interrupt_core(std::uint32_t target, std::uint8_t vector);
    /// An interrupt that InterruptsOff does not hold back, to every other core.
    static void stop_other_cores();
    static void route(std::uint32_t number, std::uint8_t vector, std::uint32_t target);

    /// The guarantee report names it by these words.
    static const char* describe() { return "GICv2, generic timer"; }

  private:
    static constexpr std::uint32_t kNumbers = 160;  // those of the computer's lines end there

    inline static constinit std::uint64_t distributor_ = 0, cpu_ = 0;
    inline static constinit std::array<std::uint8_t, kNumbers> vectors_{};
};

/// The lines of devices: `line` is the number of a shared peripheral interrupt.
class GicLines final : public InterruptSource {
  public:
    void route(std::uint8_t line, std::uint8_t vector, std::uint32_t target) override {
        constexpr std::uint32_t kFirstShared = 32;
        Gic::route(kFirstShared + line, vector, target);
    }
};

}  // namespace qduino::board::metal
