#include "tests/unit/runtime/allocation_count.h"

#include <atomic>
#include <cstdlib>
#include <new>

namespace {
std::atomic<std::size_t> allocations{0};
}

namespace qduino::testing {
std::size_t allocation_count() { return allocations.load(std::memory_order_relaxed); }
}  // namespace qduino::testing

// The replacements of the whole program. In a file of their own: inlined into others they look
// mismatched to the compiler.
void* operator new(std::size_t size) {
    allocations.fetch_add(1, std::memory_order_relaxed);
    if (void* memory = std::malloc(size)) return memory;
    throw std::bad_alloc{};
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
