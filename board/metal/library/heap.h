// The heap: blocks of powers of two, each size with its own list of free ones.
//
//   free[5]  32 B  ─► ▢ ─► ▢            allocate: the first of the list, or new memory
//   free[6]  64 B  ─► ▢                 free:     to the front of its list
//   …
//   free[30]  1 GiB
//
// Both take the same few instructions every time, on any core. Blocks are never joined: a program
// that asks for one size after another may run out earlier than with a cleverer heap. Loops with a
// budget do not allocate (house rule 6); `setup()` and the classic `loop()` do.
#pragma once

#include <cstddef>
#include <cstdint>

namespace qduino::board::metal {

/// The memory that it may give. Before anything allocates.
void set_heap(std::uint64_t begin, std::uint64_t end);

/// `alignment` is a power of two. Null when memory is out.
[[nodiscard]] void* allocate(std::size_t bytes, std::size_t alignment = 16);
/// Null is allowed.
void deallocate(void* memory);

}  // namespace qduino::board::metal
