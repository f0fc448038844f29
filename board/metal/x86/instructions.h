// x86-64's part of computer/instructions.h: ports, model-specific registers, the time-stamp
// counter, the interrupt flag.
#pragma once

#include <cstdint>

namespace qduino::board::metal {

// ---- ports -------------------------------------------------------------------------------------

inline void port_write(std::uint16_t port, std::uint8_t value) {
    asm volatile("outb %0, %1" : : "a"(value), "Nd"(port));
}
inline std::uint8_t port_read(std::uint16_t port) {
    std::uint8_t value = 0;
    asm volatile("inb %1, %0" : "=a"(value) : "Nd"(port));
    return value;
}

/// To the witness: an emulator writes such bytes down.
inline void write_virtual_pin(std::uint8_t number, bool high) {
    constexpr std::uint16_t kPinsPort = 0x2e8;
    port_write(kPinsPort, static_cast<std::uint8_t>(number | (high ? 0x80 : 0)));
}

// ---- the processor's own -----------------------------------------------------------------------

inline std::uint64_t msr_read(std::uint32_t number) {
    std::uint32_t low = 0, high = 0;
    asm volatile("rdmsr" : "=a"(low), "=d"(high) : "c"(number));
    return std::uint64_t{high} << 32 | low;
}
inline void msr_write(std::uint32_t number, std::uint64_t value) {
    asm volatile("wrmsr"
                 :
                 : "c"(number), "a"(static_cast<std::uint32_t>(value)),
                   "d"(static_cast<std::uint32_t>(value >> 32))
                 : "memory");
}

struct ProcessorFacts {
    std::uint32_t eax = 0, ebx = 0, ecx = 0, edx = 0;
};
inline ProcessorFacts cpuid(std::uint32_t leaf) {
    ProcessorFacts facts;
    asm volatile("cpuid"
                 : "=a"(facts.eax), "=b"(facts.ebx), "=c"(facts.ecx), "=d"(facts.edx)
                 : "a"(leaf), "c"(0));
    return facts;
}

/// Not before what stands in front of it has been carried out (Intel SDM volume 2, RDTSC).
inline std::uint64_t clock_count() {
    std::uint32_t low = 0, high = 0;
    asm volatile("lfence\n\trdtsc" : "=a"(low), "=d"(high) : : "memory");
    return std::uint64_t{high} << 32 | low;
}

inline bool clock_is_invariant() {
    constexpr std::uint32_t kAdvanced = 0x80000007;
    return cpuid(0x80000000).eax >= kAdvanced && (cpuid(kAdvanced).edx >> 8 & 1) != 0;
}

/// What was stored before is seen by others before what follows begins. A WRMSR to the local APIC
/// waits for no store by itself (Intel SDM volume 3, 11.5.4.1, 11.12.3).
inline void order_stores() { asm volatile("mfence\n\tlfence" : : : "memory"); }
inline void spin_hint() { asm volatile("pause" : : : "memory"); }
inline void disable_interrupts() { asm volatile("cli" : : : "memory"); }
inline void enable_interrupts() { asm volatile("sti" : : : "memory"); }
inline bool interrupts_enabled() {
    std::uint64_t flags = 0;
    asm volatile("pushfq\n\tpopq %0" : "=r"(flags) : : "memory");
    return (flags & 0x200) != 0;
}
/// Lets interrupts come, and sleeps until one does. `sti` takes effect behind the next instruction,
/// so none is missed in between.
inline void wait_for_interrupt() { asm volatile("sti\n\thlt" : : : "memory"); }
inline void halt() { asm volatile("hlt"); }
/// The kernel is entered here, and decides anew who runs.
inline void enter_by_itself() { asm volatile("int $0x30" : : : "memory"); }
/// The object that Processor::open() was told.
inline void* core_object() {
    void* core = nullptr;
    asm volatile("movq %%gs:0, %0" : "=r"(core));
    return core;
}
/// Takes some time that grows with `turns`, and touches no memory. `turns` > 0.
inline void count_down(std::uint64_t turns) {
    asm volatile("1:\n\tdecq %0\n\tjnz 1b" : "+r"(turns) : : "cc");
}

}  // namespace qduino::board::metal
