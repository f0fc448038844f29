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

/// Says it on stderr. `who`: "loop 1". The others are what a handler of SIGSEGV, SIGBUS, SIGFPE,
/// SIGILL or SIGABRT was told.
void say_crash(const std::string& who, int signal, const siginfo_t* info, const void* context);
/// Reads the tables of lines (0.1 s, 24 MB), so that a handler need not: for a sketch in real time,
/// whose supervisor takes silence for a hang. Before the handlers are installed.
void prepare_crash_words();
/// "loop 1", "setup()", "a handler on io 33".
[[nodiscard]] std::string name_of_vcpu(board::VcpuId vcpu);

}  // namespace qduino::apps
