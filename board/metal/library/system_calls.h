// The C library's one way out. musl asks a system for what it cannot do itself by the instruction
// `syscall`, with Linux's numbers. This kernel answers three of them:
//
//   write, writev   standard output: Serial's line; standard error: report() (panic.h)
//   exit_group      the machine is turned off
//
// and says "not implemented" to all others. So printf() works as it is, and what needs files, time
// or processes fails as the library says that it may.
#pragma once

namespace qduino::board::metal {

/// The calling core answers from now on.
void accept_system_calls();

}  // namespace qduino::board::metal
