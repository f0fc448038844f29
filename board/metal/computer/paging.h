// Memory that must not be touched: page 0, and one page below every stack.
//
// All memory is mapped in pages of 2 MiB (x86/entry.S). Page 0 would make a null pointer a store
// into the computer's first bytes, and a stack that grows too far would write over its neighbour.
// So page 0 and those of the stacks are split into pages of 4 KiB, of which some are taken out. A
// touch of one is a page fault, and that is the panic (panic.h). The compiler lets a frame that is
// larger than a page touch each of its pages, so none steps over (-fstack-clash-protection).
//
//   ┄┄┊▒┊──────── the host's ────────┊▒┊─── stack 0 ───┊▒┊─── stack 1 ───┊▒┊ …       ▒ not there
#pragma once

#include <cstddef>
#include <cstdint>

namespace qduino::board::metal {

/// Each with the page that is not there. The host's: a report alone takes 60 KiB.
inline constexpr std::size_t kStackBytes = 128 * 1024, kHostStackBytes = 2048 * 1024;
inline constexpr std::size_t kStackCount = 64;

/// Once, before other cores start. `directories`: an entry for each 2 MiB of addresses, as the
/// processor reads them. `image_offset`: memory's addresses of the image, less its own.
void forbid_guard_pages(std::uint64_t* directories, std::uint64_t image_offset);
[[nodiscard]] std::uint64_t host_stack_top();
/// The top of stack `index`, a multiple of 16; index < kStackCount.
[[nodiscard]] std::uint64_t stack_top(std::size_t index);
/// `address` is in page 0, or in the page below a stack.
[[nodiscard]] bool is_guard_page(std::uint64_t address);

}  // namespace qduino::board::metal
