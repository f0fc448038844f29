// aarch64's part of computer/instructions.h: system registers, the generic timer's counter, the
// interrupt mask.
//
// Arm ARM (DDI 0487): D19 (system registers), C6.2 (instructions), D12 (the generic timer).
#pragma once

#include <cstdint>

namespace qduino::board::metal {

/// As the assembler names the register: READ_SYSTEM(cntfrq_el0).
#define QDUINO_READ_SYSTEM(name)                                    \
    __extension__({                                                 \
        std::uint64_t value_ = 0;                                   \
        asm volatile("mrs %0, " #name : "=r"(value_) : : "memory"); \
        value_;                                                     \
    })
#define QDUINO_WRITE_SYSTEM(name, value) \
    asm volatile("msr " #name ", %0\n\tisb" : : "r"(static_cast<std::uint64_t>(value)) : "memory")

/// Not before what stands in front of it has been carried out.
inline std::uint64_t clock_count() {
    std::uint64_t count = 0;
    asm volatile("isb\n\tmrs %0, cntvct_el0" : "=r"(count) : : "memory");
    return count;
}
/// The architecture promises it (D12.1.2).
inline bool clock_is_invariant() { return true; }

inline void spin_hint() { asm volatile("yield" : : : "memory"); }
inline void disable_interrupts() { asm volatile("msr daifset, #2" : : : "memory"); }
inline void enable_interrupts() { asm volatile("msr daifclr, #2" : : : "memory"); }
inline bool interrupts_enabled() {
    constexpr std::uint64_t kMasked = 0x80;
    return (QDUINO_READ_SYSTEM(daif) & kMasked) == 0;
}
/// Sleeps until an interrupt comes, and lets it come. One that came before the core sleeps ends
/// the sleep at once, masked or not, so none is missed in between.
inline void wait_for_interrupt() {
    asm volatile("msr daifset, #2\n\tdsb sy\n\twfi\n\tmsr daifclr, #2\n\tisb" : : : "memory");
}
inline void halt() { asm volatile("dsb sy\n\twfi"); }
/// The kernel is entered here, and decides anew who runs.
inline void enter_by_itself() { asm volatile("svc #0x30" : : : "memory"); }
/// The object that Processor::open() was told.
inline void* core_object() { return *reinterpret_cast<void**>(QDUINO_READ_SYSTEM(tpidr_el1)); }
/// Takes some time that grows with `turns`, and touches no memory. `turns` > 0.
inline void count_down(std::uint64_t turns) {
    asm volatile("1:\n\tsubs %0, %0, #1\n\tb.ne 1b" : "+r"(turns) : : "cc");
}
/// No emulator of such a computer writes bytes of a port down: its pins are those of a chip.
inline void write_virtual_pin(std::uint8_t, bool) {}

}  // namespace qduino::board::metal
