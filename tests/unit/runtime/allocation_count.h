// Counts what a program takes from the heap, to show that a real-time path takes nothing.
#pragma once

#include <cstddef>

namespace qduino::testing {

/// Calls of operator new so far, by all threads.
[[nodiscard]] std::size_t allocation_count();

}  // namespace qduino::testing
