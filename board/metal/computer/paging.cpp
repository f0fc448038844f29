#include "board/metal/computer/paging.h"

#include <array>

#include "base/contract.h"
#include "board/metal/computer/processor.h"

namespace qduino::board::metal {
namespace {

constexpr std::size_t kPage = 4096;
constexpr std::size_t kLargePage = 512 * kPage;

struct alignas(kPage) PageTable {
    std::array<std::uint64_t, 512> entries{};
};
struct alignas(kLargePage) Stacks {
    std::array<std::uint8_t, kHostStackBytes> host;
    std::array<std::uint8_t, kStackCount * kStackBytes> threads;
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
        table.entries[i] = page_entry(begin + offset + i * kPage);
    directory = 0;  // never two translations of one address (Arm ARM DDI 0487, D8.14.1)
    forget_translations();
    directory = table_entry(address_of(&table) + offset);
    return table;
}

}  // namespace

void forbid_guard_pages(std::uint64_t* directories, std::uint64_t image_offset) {
    if (is_large_page(directories[0])) split(directories[0], 0, 0).entries[0] = 0;
    for (std::size_t at = 0; at < sizeof stacks; at += kLargePage) {
        const std::uint64_t begin = address_of(&stacks) + at;
        PageTable& table = split(directories[begin / kLargePage], begin, image_offset);
        for (std::size_t i = 0; i < kLargePage; i += kPage) {
            if (is_guard_page(begin + i)) table.entries[i / kPage] = 0;
        }
    }
    forget_translations();
}

std::uint64_t host_stack_top() { return address_of(&stacks.threads); }

std::uint64_t stack_top(std::size_t index) {
    QDUINO_EXPECT(index < kStackCount);
    return address_of(&stacks.threads) + (index + 1) * kStackBytes;
}

bool is_guard_page(std::uint64_t address) {
    if (address < kPage) return true;
    const std::uint64_t offset = address - address_of(&stacks);
    const bool in_the_hosts = offset >= kPage && offset < kHostStackBytes;
    return offset < sizeof stacks && !in_the_hosts && offset % kStackBytes < kPage;
}

}  // namespace qduino::board::metal
