// The most heap that a program has had at a time: what operator new gave, and nobody returned.
#pragma once

#include <cstddef>

namespace qduino::testing {

/// Bytes now, by all threads.
[[nodiscard]] std::size_t heap_bytes();
/// The most since the last call of reset_heap_peak().
[[nodiscard]] std::size_t heap_peak();
void reset_heap_peak();

}  // namespace qduino::testing
