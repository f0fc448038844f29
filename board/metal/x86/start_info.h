// What the loader hands over: Xen's struct hvm_start_info and struct hvm_memmap_table_entry, which
// are the PVH boot protocol's (docs/misc/pvh.pandoc there).
#pragma once

#include <cstdint>

namespace qduino::board::metal {

struct StartInfo {
    static constexpr std::uint32_t kMagic = 0x336ec578;

    std::uint32_t magic;
    std::uint32_t version;
    std::uint32_t flags;
    std::uint32_t modules;
    std::uint64_t modules_at;
    std::uint64_t command_line_at;
    std::uint64_t rsdp_at;
    // From version 1 on:
    std::uint64_t memory_at;
    std::uint32_t memory_ranges;
    std::uint32_t reserved;
};

struct MemoryRange {
    static constexpr std::uint32_t kRam = 1;

    std::uint64_t begin;
    std::uint64_t size;
    std::uint32_t kind;
    std::uint32_t reserved;
};

}  // namespace qduino::board::metal
