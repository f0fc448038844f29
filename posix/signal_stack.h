// A stack for the handlers of signals of one thread: its own may be what overflowed.
#pragma once

#include <sys/mman.h>

#include <csignal>
#include <cstddef>

namespace qduino::posix {

/// The calling thread's, while it lives. It is in RAM already, so that no handler waits for it.
/// Without memory for it the handlers run on the thread's own stack. Setup-time.
class SignalStack {
  public:
    SignalStack() {
        void* const memory = ::mmap(nullptr, kBytes, PROT_READ | PROT_WRITE,
                                    MAP_PRIVATE | MAP_ANONYMOUS | MAP_POPULATE, -1, 0);
        if (memory == MAP_FAILED) return;
        memory_ = memory;
        stack_t stack{};
        stack.ss_sp = memory;
        stack.ss_size = kBytes;
        ::sigaltstack(&stack, nullptr);
    }
    ~SignalStack() {
        if (!memory_) return;
        stack_t none{};
        none.ss_flags = SS_DISABLE;
        ::sigaltstack(&none, nullptr);
        ::munmap(memory_, kBytes);
    }
    SignalStack(const SignalStack&) = delete;
    SignalStack& operator=(const SignalStack&) = delete;

  private:
    static constexpr std::size_t kBytes = 256 * 1024;
    void* memory_ = nullptr;
};

}  // namespace qduino::posix
