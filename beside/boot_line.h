// What Linux's boot line has to say, so that a core and some memory can be had beside Linux:
//
//   memmap=184M$0x10000000   this memory is not Linux's: board/window/beside_layout.h
//   memmap=4K$0x90000        nor is this page below 1 MiB, in which a core begins
//   iomem=relaxed            root may map the local APIC, with which a core is started
//   nox2apic                 … which is in memory then; where the processor has the other mode
//   no_ipi_broadcast=1       Linux interrupts its own cores alone; where it keeps two or more
//
// Linux, Documentation/admin-guide/kernel-parameters.txt.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace qduino::apps::beside_linux {

inline constexpr std::size_t kPage = 4096;

/// The computer, as far as it decides about these words.
struct Computer {
    int cores = 2;  ///< all that Linux knows
    bool has_x2apic = false;
    std::string boot_words;  ///< the boot line, /proc/cmdline
};

struct BootLine {
    std::uint64_t memory_at = 0;       ///< kBesideBytes from here on are kept free; 0: none are
    std::uint32_t page_at = 0;         ///< the page below 1 MiB; 0: none is
    std::vector<std::string> missing;  ///< words to add; empty: all is there
};

[[nodiscard]] BootLine read_boot_line(const Computer& computer);

/// This computer. `root` precedes /proc and /sys (tests).
[[nodiscard]] Computer this_computer(const std::string& root);

/// The words, with a blank between two.
[[nodiscard]] std::string joined(const std::vector<std::string>& words);

}  // namespace qduino::apps::beside_linux
