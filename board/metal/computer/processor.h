// What differs between processors when a core changes from one context to another, and when an
// exception stops it. Each architecture's header has the same:
//
//   Frame        what an interrupt leaves on the kernel stack: `vector`, begin()
//   Processor    one of each core: open(), go_on_with()
//   names of exceptions, numbers of the C library's calls, where thread-locals lie
#pragma once

#include <cstdint>
#include <string_view>

#ifdef __aarch64__
#include "board/metal/aarch64/processor.h"
#else
#include "board/metal/x86/processor.h"
#endif

namespace qduino::board::metal {

/// Vectors below are exceptions of the processor.
inline constexpr std::uint64_t kExceptions = 32;
/// Another core's panic stops this one.
inline constexpr std::uint64_t kStopVector = 2;

/// Calls `touched` with the address when the exception is about one.
[[nodiscard]] bool is_about_memory(const Frame& frame, std::uint64_t& address);
[[nodiscard]] std::string_view exception_name(const Frame& frame);

}  // namespace qduino::board::metal
