#include "board/metal/machine/paging.h"

#include <array>

#include "base/contract.h"

namespace qduino::board::metal {
namespace {

constexpr std::size_t kPage = 4096;
constexpr std::size_t kLargePage = 512 * kPage;
constexpr std::uint64_t kPresentWritable = 3;

struct alignas(kPage) PageTable {
    std::array<std::uint64_t, 512> entries{};
};
struct alignas(kLargePage) Stacks {
    std::array<std::uint8_t, kStackCount * kStackBytes> bytes;
};

constinit Stacks stacks{};
constinit std::array<PageTable, 1 + sizeof(Stacks) / kLargePage> tables{};
constinit std::size_t tables_used = 0;

std::uint64_t address_of(const void* pointer) { return reinterpret_cast<std::uint64_t>(pointer); }

/// The page of 2 MiB at `begin` as pages of 4 KiB with the same content.
PageTable& split(std::uint64_t& directory, std::uint64_t begin, std::uint64_t offset) {
    QDUINO_EXPECT(tables_used < tables.size() && begin % kLargePage == 0);
    PageTable& table = tables[tables_used++];
    for (std::size_t i = 0; i < table.entries.size(); ++i)
        table.entries[i] = (begin + offset + i * kPage) | kPresentWritable;
    directory = (address_of(&table) + offset) | kPresentWritable;
    return table;
}

/// Makes this core forget what it knew of the tables.
void forget_translations() {
    std::uint64_t tables_at = 0;
    asm volatile("movq %%cr3, %0\n\tmovq %0, %%cr3" : "=r"(tables_at) : : "memory");
}

}  // namespace

void forbid_guard_pages(std::uint64_t* directories, std::uint64_t image_offset) {
    constexpr std::uint64_t kIsLarge = 0x80;
    if ((directories[0] & kIsLarge) != 0) split(directories[0], 0, 0).entries[0] = 0;
    for (std::size_t at = 0; at < sizeof stacks; at += kLargePage) {
        const std::uint64_t begin = address_of(&stacks) + at;
        PageTable& table = split(directories[begin / kLargePage], begin, image_offset);
        for (std::size_t i = 0; i < kLargePage; i += kStackBytes) table.entries[i / kPage] = 0;
    }
    forget_translations();
}

std::uint64_t stack_top(std::size_t index) {
    QDUINO_EXPECT(index < kStackCount);
    return address_of(&stacks) + (index + 1) * kStackBytes;
}

bool is_guard_page(std::uint64_t address) {
    if (address < kPage) return true;
    const std::uint64_t offset = address - address_of(&stacks);
    return offset < sizeof stacks && offset % kStackBytes < kPage;
}

}  // namespace qduino::board::metal
