#include "tests/unit/printd/heap_peak.h"

#include <malloc.h>

#include <atomic>
#include <cstdlib>
#include <new>

namespace {
std::atomic<std::size_t> held{0};
std::atomic<std::size_t> peak{0};
}  // namespace

namespace qduino::testing {
std::size_t heap_bytes() { return held.load(); }
std::size_t heap_peak() { return peak.load(); }
void reset_heap_peak() { peak = held.load(); }
}  // namespace qduino::testing

// The replacements of the whole program. In a file of their own: inlined into others they look
// mismatched to the compiler.
void* operator new(std::size_t size) {
    void* const memory = std::malloc(size);
    if (memory == nullptr) throw std::bad_alloc{};
    const std::size_t now = held += ::malloc_usable_size(memory);
    std::size_t before = peak.load();
    while (before < now && !peak.compare_exchange_weak(before, now)) {
    }
    return memory;
}
void operator delete(void* memory) noexcept {
    held -= ::malloc_usable_size(memory);
    std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept { operator delete(memory); }
