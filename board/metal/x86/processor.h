// x86-64's part of computer/processor.h.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "board/metal/computer/instructions.h"
#include "board/metal/x86/descriptors.h"

namespace qduino::board::metal {

/// As x86/entry.S pushes it. The floating-point state is the FXSAVE format (SDM volume 1, 10.5.1).
///
///   ┌─ top of the kernel stack
///   │ ss, rsp, flags, cs, rip     the processor
///   │ error, vector               the stub: the processor, or a zero in its place
///   │ rax … r15                   save_all
///   │ floating_point              save_all: 512 bytes
///   └─ Frame*
struct Frame {
    static constexpr std::size_t kFirstArgument = 9;  ///< rdi, among the registers

    /// Goes on with entry(argument), with interrupts on, on the stack that ends at `top`.
    void begin(void (*entry)(void*), void* argument, std::uint64_t top);
    [[nodiscard]] std::uint64_t at() const { return rip; }
    [[nodiscard]] std::uint64_t stack() const { return rsp; }

    alignas(16) std::array<std::uint8_t, 512> floating_point;
    std::array<std::uint64_t, 15> registers;  ///< r15 … r8, rbp, rdi, rsi, rdx, rcx, rbx, rax
    std::uint64_t vector, error;
    std::uint64_t rip, cs, flags, rsp, ss;
};

class Processor {
  public:
    /// On the core itself, once: `core` is what core_object() returns from now on.
    void open(void* core);
    /// The next interrupt of this core runs on the stack that ends at `top`, and what thread-locals
    /// are is at `thread_locals`.
    void go_on_with(std::uint64_t top, std::uint64_t thread_locals) {
        descriptors_.set_kernel_stack(top);
        set_thread_locals(thread_locals);
    }
    static void set_thread_locals(std::uint64_t at) { msr_write(kFsBase, at); }

  private:
    static constexpr std::uint32_t kFsBase = 0xc0000100, kGsBase = 0xc0000101;

    void* core_ = nullptr;  // first: %gs:0
    Descriptors descriptors_;
};

/// Linux, arch/x86/entry/syscalls/syscall_64.tbl.
enum class SystemCall : std::uint64_t { write = 1, writev = 20, exit_group = 231 };

/// ELF handling for thread-local storage (U. Drepper, 2013), variant II: variables lie below the
/// address in %fs, and the first word there is that address. musl keeps errno and its locale behind
/// it (struct pthread).
///
///   ┌── the image's .tdata, then zeroes ──┬── its own address ── the C library's part ──┐
///                                        └ %fs
struct ThreadLocalsLayout {
    static constexpr std::size_t kLibrary = 512;
    static constexpr std::size_t below(std::size_t size, std::size_t) { return size; }
    static constexpr std::size_t above(std::size_t, std::size_t) { return kLibrary; }
    static constexpr std::ptrdiff_t variables(std::size_t size, std::size_t) {
        return -static_cast<std::ptrdiff_t>(size);
    }
    /// Where `thread_locals_mark` is, from the address in %fs on, as the linker has it.
    static std::ptrdiff_t of_mark() {
        std::ptrdiff_t place = 0;
        asm("movq $thread_locals_mark@tpoff, %0" : "=r"(place));
        return place;
    }
};

// ---- entries of page tables: SDM volume 3, 4.5.4 ------------------------------------------------

inline std::uint64_t page_entry(std::uint64_t address) { return address | 3; }  // present, writable
inline std::uint64_t table_entry(std::uint64_t address) { return address | 3; }
inline bool is_large_page(std::uint64_t entry) { return (entry & 0x80) != 0; }
/// Makes this core forget what it knew of the tables.
inline void forget_translations() {
    std::uint64_t tables_at = 0;
    asm volatile("movq %%cr3, %0\n\tmovq %0, %%cr3" : "=r"(tables_at) : : "memory");
}

}  // namespace qduino::board::metal
