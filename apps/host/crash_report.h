// The last words of a sketch that crashes: which loop, in which line, why, and what to do.
//
//   Verdict: loop 1 died at blink.ino:12 (SIGFPE): it divides by zero. An AVR goes on there…
//
// Called in a signal's handler, when nothing of the sketch will run again and its safe states are
// forced. It looks up the program's debug lines and allocates: where the sketch died in the memory
// allocator that may wait for ever, so an alarm ends it after five seconds.
#pragma once

#include <csignal>
#include <string>

#include "board/types.h"

namespace qduino::apps {

/// What a handler of SIGSEGV, SIGBUS, SIGFPE, SIGILL or SIGABRT was told.
struct Crash {
    int signal = 0;
    int code = 0;                         ///< si_code
    const void* address = nullptr;        ///< si_addr: that was followed
    const void* instruction = nullptr;    ///< that did it; null: unknown
    const void* stack_pointer = nullptr;  ///< there
};

/// "it divides by zero (SIGFPE)", and what to do about it.
[[nodiscard]] std::string cause_of(const Crash& crash);

/// Says it on stderr. `who`: "loop 1".
void say_crash(const std::string& who, int signal, const siginfo_t* info, const void* context);
/// Loads what the words need, so that a handler need not. Before the handlers are installed.
void prepare_crash_words();
/// "loop 1", "setup()", "a handler on io 33".
[[nodiscard]] std::string name_of_vcpu(board::VcpuId vcpu);

}  // namespace qduino::apps
