// What the loader tells, whichever it is. A copy: its own words may lie where the heap will be.
//
//   PVH          start info ─┐
//   multiboot2   list of tags┼─► BootFacts: command line, root of the firmware's tables, memory
//   aarch64      device tree ┤
//   Linux        BesideArea  ┘
//
// Multiboot2 Specification 2.0, 3.6 (boot information). PVH: x86/start_info.h. On a core that
// Linux gave up: board/window/beside_layout.h.
#pragma once

#include <array>
#include <cstdint>

#include "base/fixed_string.h"
#include "board/window/beside_layout.h"

namespace qduino::board::metal {

struct BootFacts {
    FixedString<256> words;                    ///< the command line
    std::uint64_t rsdp_at = 0;                 ///< 0: the firmware's memory has to be searched
    std::array<std::uint8_t, 36> rsdp_copy{};  ///< what it points at, where the loader has a copy
    std::uint64_t ram_end = 0;                 ///< of the range of RAM that was asked for; 0: none
    BesideArea* beside = nullptr;              ///< what is shared with Linux; null: there is none
};

}  // namespace qduino::board::metal
