// An image (qduino metal build), put into the memory that it shares with Linux, and what its core
// needs to begin: page tables, and a copy of the trampoline.
//
//   ELF: PT_LOAD ─► memory from kImageOffset on; the rest of that is zeroed
//        PT_NOTE ─► where in the image the trampoline is (kBesideNoteName)
//
// System V ABI, Object Files; Intel SDM volume 3, 4.5 (the tables' entries).
#pragma once

#include <cstdint>
#include <span>

#include "base/result.h"
#include "board/window/beside_layout.h"

namespace qduino::apps::beside_linux {

/// Where an image's core finds things in the computer's memory.
struct Places {
    std::uint64_t memory_at = 0;  ///< of what is shared
    std::uint32_t page_at = 0;    ///< of the trampoline
};

/// Puts `image` into `memory`, which is kImageBytes at memory_at + kImageOffset. Returns its
/// trampoline, which lies in `memory`. Error: corrupt (not such an image, too large, or older than
/// its trampoline); nothing was started then.
[[nodiscard]] Result<std::span<const std::uint8_t>> load_image(std::span<const std::uint8_t> image,
                                                               std::span<std::uint8_t> memory);

/// Maps the shared memory, the image, the trampoline's page and the local APIC; nothing else.
void map_memory(const Places& places, board::BesideTables& tables);

/// Copies the trampoline into its `page`, and tells it what is where.
void place_trampoline(std::span<const std::uint8_t> trampoline, const Places& places,
                      std::span<std::uint8_t> page);

}  // namespace qduino::apps::beside_linux
