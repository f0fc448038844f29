#include "beside/boot_line.h"

#include <algorithm>
#include <optional>

#include "base/parts.h"
#include "base/text.h"
#include "base/whole_number.h"
#include "board/linux/kernel/cpu_list.h"
#include "board/linux/kernel/kernel_text.h"
#include "board/window/beside_layout.h"

namespace qduino::apps::beside_linux {
namespace {

using board::linux::text_of_file;
using board::linux::words;

/// As the kernel reads numbers: decimal, or hexadecimal behind 0x, with K, M or G.
std::optional<std::uint64_t> size_of(std::string_view text) {
    int shift = 0;
    if (!text.empty()) {
        switch (text.back()) {
            case 'G':
            case 'g':
                shift = 30;
                break;
            case 'M':
            case 'm':
                shift = 20;
                break;
            case 'K':
            case 'k':
                shift = 10;
                break;
            default:
                break;
        }
    }
    if (shift > 0) text.remove_suffix(1);
    const bool hexadecimal = text.starts_with("0x") || text.starts_with("0X");
    const auto number =
        whole_number<std::uint64_t>(hexadecimal ? text.substr(2) : text, hexadecimal ? 16 : 10);
    if (!number || *number > UINT64_MAX >> shift) return std::nullopt;
    return *number << shift;
}

struct Range {
    std::uint64_t begin = 0, size = 0;
};

/// "184M$0x10000000"; nothing: not a range that is kept free.
std::optional<Range> kept_range(std::string_view text) {
    const std::size_t sign = text.find('$');
    if (sign == std::string_view::npos) return std::nullopt;
    const auto size = size_of(text.substr(0, sign)), begin = size_of(text.substr(sign + 1));
    if (!size || !begin) return std::nullopt;
    return Range{*begin, *size};
}

/// Takes what the range is good for.
void take(const Range& range, BootLine& line) {
    using board::kBesideBytes;
    constexpr std::uint64_t kLowEnd = 1 << 20;
    const std::uint64_t begin = (std::max(range.begin, board::kBesideLowest) + board::kLargePage - 1) /
                                board::kLargePage * board::kLargePage;
    const std::uint64_t end = std::min(range.begin + range.size, board::kBesideHighest);
    if (line.memory_at == 0 && begin + kBesideBytes <= end) line.memory_at = begin;
    const std::uint64_t page = (std::max<std::uint64_t>(range.begin, kPage) + kPage - 1) / kPage * kPage;
    if (line.page_at == 0 && page + kPage <= std::min(range.begin + range.size, kLowEnd))
        line.page_at = static_cast<std::uint32_t>(page);
}

}  // namespace

BootLine read_boot_line(const Computer& computer) {
    BootLine line;
    bool relaxed = false, no_x2apic = false, no_broadcast = false;
    for (std::string_view word : words(computer.boot_words)) {
        relaxed = relaxed || word == "iomem=relaxed";
        no_x2apic = no_x2apic || word == "nox2apic";
        no_broadcast = no_broadcast || word == "no_ipi_broadcast=1";
        if (!word.starts_with("memmap=")) continue;
        word.remove_prefix(std::string_view{"memmap="}.size());
        for (const std::string_view each : parts(word, ",")) {
            if (const auto range = kept_range(each)) take(*range, line);
        }
    }
    if (line.memory_at == 0)
        line.missing.push_back(text<std::string>("memmap=", board::kBesideBytes >> 20, "M$0x10000000"));
    if (line.page_at == 0) line.missing.emplace_back("memmap=4K$0x90000");
    if (!relaxed) line.missing.emplace_back("iomem=relaxed");
    if (computer.has_x2apic && !no_x2apic) line.missing.emplace_back("nox2apic");
    if (computer.cores > 2 && !no_broadcast) line.missing.emplace_back("no_ipi_broadcast=1");
    return line;
}

Computer this_computer(const std::string& root) {
    Computer computer;
    const auto present =
        board::linux::CpuList::from_list(text_of_file(root + "/sys/devices/system/cpu/present"));
    computer.cores = present ? present->size() : 1;
    const std::string facts = text_of_file(root + "/proc/cpuinfo");
    computer.has_x2apic = std::ranges::count(words(facts), "x2apic") > 0;
    computer.boot_words = text_of_file(root + "/proc/cmdline");
    return computer;
}

std::string joined(const std::vector<std::string>& list) {
    std::string line;
    for (const std::string& word : list) line += (line.empty() ? "" : " ") + word;
    return line;
}

}  // namespace qduino::apps::beside_linux
