// The instructions that C++ has no word for: ports, model-specific registers, the time-stamp
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

// ---- registers of a device in memory -----------------------------------------------------------

inline void memory_write(std::uint64_t address, std::uint32_t value) {
    *reinterpret_cast<volatile std::uint32_t*>(address) = value;
}
inline std::uint32_t memory_read(std::uint64_t address) {
    return *reinterpret_cast<volatile std::uint32_t*>(address);
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
inline std::uint64_t time_stamp_counter() {
    std::uint32_t low = 0, high = 0;
    asm volatile("lfence\n\trdtsc" : "=a"(low), "=d"(high) : : "memory");
    return std::uint64_t{high} << 32 | low;
}

inline void spin_hint() { asm volatile("pause" : : : "memory"); }
inline void disable_interrupts() { asm volatile("cli" : : : "memory"); }
inline void enable_interrupts() { asm volatile("sti" : : : "memory"); }
inline bool interrupts_enabled() {
    std::uint64_t flags = 0;
    asm volatile("pushfq\n\tpopq %0" : "=r"(flags) : : "memory");
    return (flags & 0x200) != 0;
}
[[noreturn]] inline void halt_forever() {
    disable_interrupts();
    for (;;) asm volatile("hlt");
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
