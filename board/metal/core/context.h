// What runs on a core: a thread, the core's idle loop, or the host (the program around the loops).
//
//   interrupt ──► Frame at the top of the running context's kernel stack, the kernel works below
//                                                                         │ which context next?
//   it goes on ◄─ Frame at the top of that one's kernel stack ◄───────────┘
//
// That is the only way to switch: a thread that gives its core up interrupts itself
// (enter_by_itself()).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "board/metal/computer/processor.h"

namespace qduino::board::metal {

struct Context {
    static constexpr std::size_t kKernelStack = 16 * 1024;

    [[nodiscard]] std::uint64_t kernel_stack_top() const {
        return reinterpret_cast<std::uint64_t>(kernel_stack.data()) + kKernelStack;
    }
    [[nodiscard]] Frame& frame() { return *reinterpret_cast<Frame*>(kernel_stack_top() - sizeof(Frame)); }

    /// Begins with entry(argument), which never returns, on the stack that ends at `top`.
    void begin(void (*entry)(void*), void* argument, std::uint64_t top) {
        frame().begin(entry, argument, top);
    }

    std::uint64_t thread_locals = 0;  ///< library/thread_locals.h
    alignas(16) std::array<std::uint8_t, kKernelStack> kernel_stack{};
};

}  // namespace qduino::board::metal
