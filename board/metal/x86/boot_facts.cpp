#include "board/metal/boot/boot_facts.h"

#include <algorithm>
#include <cstring>

#include "board/metal/computer/computer.h"
#include "board/metal/x86/start_info.h"

namespace qduino::board::metal {
namespace {

constexpr std::uint32_t kMultiboot2 = 0x36d76289;
constexpr std::uint32_t kBeside = 0x51424553;  // BESIDE of x86/entry.S

template <typename T>
const T& at(std::uint64_t address) {
    return *reinterpret_cast<const T*>(address);
}

struct Tag {
    enum Kind : std::uint32_t { kEnd = 0, kWords = 1, kMemory = 6, kOldRsdp = 14, kRsdp = 15 };

    std::uint32_t kind;
    std::uint32_t size;
};

/// `step`: bytes from one range to the next.
void take_memory(std::uint64_t begin, std::uint64_t end, std::uint32_t step, std::uint64_t inside,
                 BootFacts& facts) {
    for (; begin + sizeof(MemoryRange) <= end; begin += step) {
        const auto& range = at<MemoryRange>(begin);
        const std::uint64_t range_end = range.begin + range.size;
        if (range.kind == MemoryRange::kRam && range.begin <= inside && inside < range_end)
            facts.ram_end = range_end;
    }
}

void take_start_info(const StartInfo& info, std::uint64_t inside, BootFacts& facts) {
    if (info.command_line_at != 0) facts.words.assign(&at<char>(info.command_line_at));
    facts.rsdp_at = info.rsdp_at;
    const std::uint64_t size = std::uint64_t{info.memory_ranges} * sizeof(MemoryRange);
    take_memory(info.memory_at, info.memory_at + size, sizeof(MemoryRange), inside, facts);
}

void take_tag(const Tag& tag, std::uint64_t inside, BootFacts& facts) {
    const std::uint64_t content = reinterpret_cast<std::uint64_t>(&tag) + sizeof tag;
    const std::size_t size = tag.size - sizeof tag;
    switch (tag.kind) {
        case Tag::kWords:
            return facts.words.assign(&at<char>(content));
        case Tag::kMemory:  // size and version of an entry come first
            return take_memory(content + 8, content + size, std::max(at<std::uint32_t>(content), 1u), inside,
                               facts);
        case Tag::kOldRsdp:
        case Tag::kRsdp:  // where both are, the new one comes last
            std::memcpy(facts.rsdp_copy.data(), &at<char>(content), std::min(size, facts.rsdp_copy.size()));
            facts.rsdp_at = reinterpret_cast<std::uint64_t>(facts.rsdp_copy.data());
            return;
        default:
            return;
    }
}

void take_tags(std::uint64_t told_at, std::uint64_t inside, BootFacts& facts) {
    const std::uint64_t end = told_at + at<std::uint32_t>(told_at);
    for (std::uint64_t next = told_at + 8; next + sizeof(Tag) <= end;) {
        const auto& tag = at<Tag>(next);
        if (tag.kind == Tag::kEnd || tag.size < sizeof(Tag)) return;
        take_tag(tag, inside, facts);
        next += (tag.size + 7) & ~7u;
    }
}

}  // namespace

bool read_boot_facts(std::uint64_t magic, std::uint64_t told_at, std::uint64_t inside, BootFacts& facts) {
    if (magic == kMultiboot2) {
        take_tags(told_at, inside, facts);
    } else if (magic == kBeside) {
        facts.beside = reinterpret_cast<BesideArea*>(told_at);
        facts.words.assign(facts.beside->words.data());
        facts.ram_end = kImageAt + kImageBytes;
    } else if (const auto& info = at<StartInfo>(told_at); info.magic == StartInfo::kMagic) {
        take_start_info(info, inside, facts);
    } else {
        return false;
    }
    return true;
}

}  // namespace qduino::board::metal
