// The variables that each context has for itself, `thread_local` ones and the C library's errno.
//
//   ┌── the image's .tdata, then zeroes ──┬── its own address ── the C library's part ──┐
//                                        └ %fs
//
// ELF handling for thread-local storage (U. Drepper, 2013), variant II, as AMD64 has it: variables
// lie below the address in %fs, and the first word there is that address. musl keeps errno and its
// locale behind it (struct pthread), less than the room here.
#pragma once

#include <cstdint>

namespace qduino::board::metal {

/// What %fs is to point at. Allocates.
[[nodiscard]] std::uint64_t make_thread_locals();

}  // namespace qduino::board::metal
