// A stackful fiber: a call stack of its own that is entered and left by name, on one thread,
// without the kernel.
//
//   host            fiber
//   resume() ─────► entry(argument)
//            ◄───── suspend()
//   resume() ─────► …continues after suspend()
//            ◄───── entry returns: finished()
//
// A switch saves what the calling convention says a function must keep (x86-64: System V psABI
// §3.2.1, six registers; aarch64: AAPCS64 §6.1, x19–x30 and d8–d15) and exchanges the stack
// pointer: about two nanoseconds. Other processors use ucontext, which does the same with two
// system calls. Sanitizers are told of every switch.
//
// Invariants: at most one fiber of a host runs at a time; only the host resumes, only the fiber
// suspends itself.
#pragma once

#include <cstddef>

namespace qduino::board::sim {

class Fiber {
  public:
    using Entry = void (*)(void* argument);

    /// Maps a stack of `stack_bytes` (rounded up to pages) with a guard page below it; nothing runs
    /// yet. Throws std::bad_alloc when there is no memory. `entry` must not let an exception
    /// escape.
    Fiber(Entry entry, void* argument, std::size_t stack_bytes);
    /// A fiber that has not finished is abandoned: its stack goes without destructors, as a killed
    /// thread's would.
    ~Fiber();
    Fiber(const Fiber&) = delete;
    Fiber& operator=(const Fiber&) = delete;

    /// Host only. Runs the fiber until it suspends or its entry returns. Contract: not finished.
    void resume();
    /// This fiber only, from inside: back to the host's resume().
    void suspend();
    [[nodiscard]] bool finished() const { return finished_; }

  private:
    static void run_entry(Fiber* self);
    friend void fiber_started(Fiber* self);

    struct Machine;  // what the kind of switch needs: fiber.cpp
    Entry entry_;
    void* argument_;
    std::byte* mapping_ = nullptr;
    std::size_t mapping_bytes_ = 0;
    Machine* machine_ = nullptr;  // lives at the high end of the stack's mapping
    bool finished_ = false;
};

}  // namespace qduino::board::sim
