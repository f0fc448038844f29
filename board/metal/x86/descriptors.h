// What the processor looks up by itself: the segments, the table of interrupts, and the stacks that
// interrupts run on.
//
//   vector 0…31     exceptions        ─► the core's panic stack: the stack may be what is broken
//   vector 32…255   interrupts, `int` ─► the running thread's kernel stack (core/thread.h)
//
// No interrupt runs on the stack that it interrupts. Libraries keep words below their stack pointer
// (the red zone: System V ABI for AMD64, 3.2.2), which a frame there would overwrite.
// Intel SDM volume 3, 6.14 (interrupts in 64-bit mode), 8.7 (task-state segment).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace qduino::board::metal {

class Descriptors {
  public:
    /// Those of the calling core, from now on. Once; the object stays where it is.
    void load();
    /// The next interrupt of this core runs on the stack that ends at `top`.
    void set_kernel_stack(std::uint64_t top) { task_.interrupt_stacks[0] = top; }

  private:
    static constexpr std::size_t kPanicStack = 8192;

    struct [[gnu::packed]] TaskState {
        std::uint32_t reserved0 = 0;
        std::array<std::uint64_t, 3> ring_stacks{};
        std::uint64_t reserved1 = 0;
        std::array<std::uint64_t, 7> interrupt_stacks{};  // number 1 is the first
        std::uint64_t reserved2 = 0;
        std::uint16_t reserved3 = 0;
        std::uint16_t port_map = sizeof(TaskState);
    };
    TaskState task_{};
    std::array<std::uint64_t, 5> segments_{};
    alignas(16) std::array<std::uint8_t, kPanicStack> panic_stack_{};
};

}  // namespace qduino::board::metal
