// The variables that each context has for itself, `thread_local` ones and the C library's errno.
// Where they lie differs between architectures: ThreadLocalsLayout of computer/processor.h.
#pragma once

#include <cstdint>

namespace qduino::board::metal {

/// The address for Processor::set_thread_locals(). Allocates.
[[nodiscard]] std::uint64_t make_thread_locals();

}  // namespace qduino::board::metal
