// aarch64's part of computer/processor.h.
//
//   SP_EL0   what runs: a thread, the idle loop, the host
//   SP_EL1   the kernel, from an exception to its end. Between two exceptions it is the top of the
//            running context's kernel stack: popping that one's frame leaves it there
//
// All run at exception level 1. Arm ARM (DDI 0487): D1.3 (exceptions), D1.6.2 (stack pointers).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "board/metal/computer/instructions.h"

namespace qduino::board::metal {

/// As aarch64/entry.S stores it.
struct alignas(16) Frame {
    /// Goes on with entry(argument), with interrupts on, on the stack that ends at `top`.
    void begin(void (*entry)(void*), void* argument, std::uint64_t top);
    [[nodiscard]] std::uint64_t at() const { return link; }
    [[nodiscard]] std::uint64_t stack() const { return sp; }

    std::array<std::uint64_t, 31> registers;  ///< x0 … x30
    std::uint64_t sp, link, state;            ///< SP_EL0, ELR_EL1, SPSR_EL1
    std::uint64_t vector;
    std::uint64_t error;  ///< an exception's syndrome (ESR_EL1), an interrupt's word from the GIC
    std::uint64_t fpcr, fpsr;
    std::array<std::uint8_t, 512> floating_point;  ///< q0 … q31
};
static_assert(sizeof(Frame) == 816 && offsetof(Frame, sp) == 248 && offsetof(Frame, fpcr) == 288);

class Processor {
  public:
    /// On the core itself, once: `core` is what core_object() returns from now on.
    void open(void* core);
    /// The next interrupt of this core runs on the stack that ends at `top`, and what thread-locals
    /// are is at `thread_locals`.
    static void go_on_with(std::uint64_t top, std::uint64_t thread_locals) {
        set_thread_locals(thread_locals);
        if (QDUINO_READ_SYSTEM(spsel) != 0) return;  // the kernel: it pops the next one's frame
        asm volatile("msr spsel, #1\n\tmov sp, %0\n\tmsr spsel, #0" : : "r"(top) : "memory");
    }
    static void set_thread_locals(std::uint64_t at) { QDUINO_WRITE_SYSTEM(tpidr_el0, at); }

  private:
    static constexpr std::size_t kPanicStack = 64 * 1024;

    void* core_ = nullptr;               // first: core_object()
    std::uint64_t panic_stack_top_ = 0;  // second: aarch64/entry.S
    alignas(16) std::array<std::uint8_t, kPanicStack> panic_stack_{};
};

/// Linux, the generic table of system calls (asm-generic).
enum class SystemCall : std::uint64_t { write = 64, writev = 66, exit_group = 94 };

/// ELF handling for thread-local storage (U. Drepper, 2013), variant I: variables lie behind the
/// address in TPIDR_EL0 and two words there. musl keeps errno and its locale in front of it
/// (struct pthread).
///
///   ┌── the C library's part ──┬── two words, up to the alignment ──┬── .tdata, then zeroes ──┐
///                              └ TPIDR_EL0
struct ThreadLocalsLayout {
    static constexpr std::size_t kLibrary = 512, kWords = 16;
    static constexpr std::size_t rounded(std::size_t size, std::size_t alignment) {
        return (size + alignment - 1) & ~(alignment - 1);
    }
    static constexpr std::size_t below(std::size_t, std::size_t alignment) {
        return rounded(kLibrary, alignment);
    }
    static constexpr std::size_t above(std::size_t size, std::size_t alignment) {
        return rounded(kWords, alignment) + size;
    }
    static constexpr std::ptrdiff_t variables(std::size_t, std::size_t alignment) {
        return static_cast<std::ptrdiff_t>(rounded(kWords, alignment));
    }
    /// Where `thread_locals_mark` is, from TPIDR_EL0 on, as the linker has it.
    static std::ptrdiff_t of_mark() {
        std::ptrdiff_t place = 0;
        asm("add %0, %0, #:tprel_hi12:thread_locals_mark, lsl #12\n\t"
            "add %0, %0, #:tprel_lo12_nc:thread_locals_mark"
            : "+r"(place));
        return place;
    }
};

// ---- entries of page tables: Arm ARM, D8.3 ------------------------------------------------------

/// Ordinary memory, shared by all cores: the access flag, inner shareable, the second of the kinds
/// that aarch64/entry.S has in MAIR_EL1.
inline std::uint64_t page_entry(std::uint64_t address) { return address | 0x707; }
inline std::uint64_t table_entry(std::uint64_t address) { return address | 3; }
inline bool is_large_page(std::uint64_t entry) { return (entry & 3) == 1; }
/// Makes all cores forget what they knew of the tables.
inline void forget_translations() {
    asm volatile("dsb ishst\n\ttlbi vmalle1is\n\tdsb ish\n\tisb" : : : "memory");
}

}  // namespace qduino::board::metal
