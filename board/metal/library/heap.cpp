#include "board/metal/library/heap.h"

#include <array>
#include <bit>
#include <cstring>
#include <new>

#include "board/metal/computer/spin_lock.h"
#include "board/metal/panic.h"

namespace qduino::board::metal {
namespace {

/// In front of what allocate() returns.
struct alignas(16) Head {
    std::uint32_t order = 0;   // the block has 2^order bytes
    std::uint32_t offset = 0;  // from the block's begin to what was returned
};
struct FreeBlock {
    FreeBlock* next = nullptr;
};

constexpr int kSmallest = 5, kLargest = 40;
constinit SpinLock heap_lock;
constinit std::array<FreeBlock*, kLargest + 1> free_blocks{};
constinit std::uint64_t unused_begin = 0;
constinit std::uint64_t unused_end = 0;

std::uint64_t take_block(int order) {
    const SpinGuard held(heap_lock);
    if (FreeBlock* const block = free_blocks[static_cast<std::size_t>(order)]) {
        free_blocks[static_cast<std::size_t>(order)] = block->next;
        return reinterpret_cast<std::uint64_t>(block);
    }
    const std::uint64_t size = std::uint64_t{1} << order;
    if (unused_end - unused_begin < size) return 0;
    const std::uint64_t block = unused_begin;
    unused_begin += size;
    return block;
}

Head& head_of(const void* memory) {
    return *reinterpret_cast<Head*>(reinterpret_cast<std::uint64_t>(memory) - sizeof(Head));
}

/// As many bytes as were asked for, or more.
std::size_t size_of_block(const void* memory) {
    const Head& head = head_of(memory);
    return (std::size_t{1} << head.order) - head.offset;
}

void* allocate_or_panic(std::size_t bytes, std::size_t alignment = 16) {
    void* const memory = allocate(bytes, alignment);
    if (!memory) panic("no memory is left");
    return memory;
}

}  // namespace

void set_heap(std::uint64_t begin, std::uint64_t end) {
    unused_begin = (begin + 63) & ~std::uint64_t{63};
    unused_end = end;
}

void* allocate(std::size_t bytes, std::size_t alignment) {
    if (bytes > std::size_t{1} << (kLargest - 1)) return nullptr;
    const std::size_t padding = alignment > 16 ? alignment : 0;
    const int order =
        std::max(kSmallest, static_cast<int>(std::bit_width(bytes + padding + sizeof(Head) - 1)));
    const std::uint64_t block = take_block(order);
    if (block == 0) return nullptr;
    std::uint64_t at = block + sizeof(Head);
    if (padding > 0) at = (at + padding - 1) & ~(std::uint64_t{padding} - 1);
    void* const memory = reinterpret_cast<void*>(at);
    head_of(memory) = {static_cast<std::uint32_t>(order), static_cast<std::uint32_t>(at - block)};
    return memory;
}

void deallocate(void* memory) {
    if (!memory) return;
    const Head head = head_of(memory);
    auto* const block = reinterpret_cast<FreeBlock*>(static_cast<std::uint8_t*>(memory) - head.offset);
    const SpinGuard held(heap_lock);
    block->next = free_blocks[head.order];
    free_blocks[head.order] = block;
}

}  // namespace qduino::board::metal

// ---- the names by which C and C++ know it -------------------------------------------------------

using namespace qduino::board::metal;

extern "C" {
void* malloc(std::size_t bytes) { return allocate(bytes); }
void free(void* memory) { deallocate(memory); }
void* calloc(std::size_t count, std::size_t bytes) {
    std::size_t size = 0;
    if (__builtin_mul_overflow(count, bytes, &size)) return nullptr;
    void* const memory = allocate(size);
    return memory ? std::memset(memory, 0, size) : nullptr;
}
void* realloc(void* memory, std::size_t bytes) {
    if (!memory) return allocate(bytes);
    const std::size_t had = size_of_block(memory);
    if (bytes <= had) return memory;
    void* const moved = allocate(bytes);
    if (!moved) return nullptr;
    std::memcpy(moved, memory, had);
    deallocate(memory);
    return moved;
}
void* aligned_alloc(std::size_t alignment, std::size_t bytes) { return allocate(bytes, alignment); }
}

// The C++ library has all other forms: they call these, and free().
void* operator new(std::size_t bytes) { return allocate_or_panic(bytes); }
void* operator new(std::size_t bytes, std::align_val_t alignment) {
    return allocate_or_panic(bytes, static_cast<std::size_t>(alignment));
}
void* operator new(std::size_t bytes, const std::nothrow_t&) noexcept { return allocate(bytes); }
void* operator new[](std::size_t bytes, const std::nothrow_t&) noexcept { return allocate(bytes); }
void operator delete(void* memory) noexcept { deallocate(memory); }
void operator delete(void* memory, std::size_t) noexcept { deallocate(memory); }
