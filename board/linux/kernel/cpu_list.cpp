#include "board/linux/kernel/cpu_list.h"

#include <cstdint>

#include "base/text.h"
#include "base/whole_number.h"
#include "board/linux/kernel/kernel_text.h"

namespace qduino::board::linux {

CpuList CpuList::first(int count) {
    CpuList all;
    for (int cpu = 0; cpu < count && cpu < kLimit; ++cpu) all.add(cpu);
    return all;
}

std::optional<CpuList> CpuList::from_list(std::string_view text) {
    CpuList cpus;
    text = trimmed(text);
    while (!text.empty()) {
        std::string_view part = cut(text, ',');
        const bool range = part.find('-') != std::string_view::npos;
        const auto low = whole_number<std::uint32_t>(cut(part, '-'));
        const auto high = range ? whole_number<std::uint32_t>(part) : low;
        if (!low || !high || *low > *high || *high >= kLimit) return std::nullopt;
        for (std::uint32_t cpu = *low; cpu <= *high; ++cpu) cpus.add(static_cast<int>(cpu));
    }
    return cpus;
}

std::optional<CpuList> CpuList::from_mask(std::string_view text) {
    CpuList cpus;
    text = trimmed(text);
    while (!text.empty()) {
        const auto group = whole_number<std::uint32_t>(cut(text, ','), 16);
        if (!group || (cpus.bits_ >> (kLimit - 32)).any()) return std::nullopt;
        cpus.bits_ = (cpus.bits_ << 32) | std::bitset<kLimit>{*group};
    }
    return cpus;
}

std::string CpuList::to_list() const {
    std::string text;
    for (int cpu = 0; cpu < kLimit; ++cpu) {
        if (!has(cpu)) continue;
        int last = cpu;
        while (has(last + 1)) ++last;
        write(text, text.empty() ? "" : ",", cpu);
        if (last > cpu) write(text, '-', last);
        cpu = last;
    }
    return text;
}

std::string CpuList::to_mask(int cpus) const {
    std::string text;
    for (int group = (cpus - 1) / 32; group >= 0; --group) {
        const auto bits =
            ((bits_ >> (32 * static_cast<std::size_t>(group))) & std::bitset<kLimit>{0xffffffffu}).to_ulong();
        FixedString<8> digits;
        write_characters(digits, bits, 16);
        if (!text.empty()) text += ',' + std::string(8 - digits.size(), '0');
        write(text, digits);
    }
    return text;
}

CpuList CpuList::without(const CpuList& others) const {
    CpuList rest = *this;
    rest.bits_ &= ~others.bits_;
    return rest;
}

}  // namespace qduino::board::linux
