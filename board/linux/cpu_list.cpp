#include "board/linux/cpu_list.h"

#include <array>
#include <cstdint>
#include <cstdio>

#include "base/whole_number.h"

namespace qduino::board::linux {
namespace {

std::string_view trimmed(std::string_view text) {
    while (!text.empty() && (text.back() == '\n' || text.back() == ' ' || text.back() == '\0'))
        text.remove_suffix(1);
    return text;
}

/// Cuts the part before the next comma off `text`.
std::string_view next_part(std::string_view& text) {
    const std::size_t comma = text.find(',');
    const std::string_view part = text.substr(0, comma);
    text = comma == std::string_view::npos ? std::string_view{} : text.substr(comma + 1);
    return part;
}

}  // namespace

CpuList CpuList::first(int count) {
    CpuList all;
    for (int cpu = 0; cpu < count && cpu < kLimit; ++cpu) all.add(cpu);
    return all;
}

std::optional<CpuList> CpuList::from_list(std::string_view text) {
    CpuList cpus;
    text = trimmed(text);
    while (!text.empty()) {
        const std::string_view part = next_part(text);
        const std::size_t dash = part.find('-');
        const auto low = whole_number<std::uint32_t>(part.substr(0, dash));
        const auto high =
            dash == std::string_view::npos ? low : whole_number<std::uint32_t>(part.substr(dash + 1));
        if (!low || !high || *low > *high || *high >= kLimit) return std::nullopt;
        for (std::uint32_t cpu = *low; cpu <= *high; ++cpu) cpus.add(static_cast<int>(cpu));
    }
    return cpus;
}

std::optional<CpuList> CpuList::from_mask(std::string_view text) {
    CpuList cpus;
    text = trimmed(text);
    while (!text.empty()) {
        const auto group = whole_number<std::uint32_t>(next_part(text), 16);
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
        if (!text.empty()) text += ',';
        text += std::to_string(cpu);
        if (last > cpu) text += '-' + std::to_string(last);
        cpu = last;
    }
    return text;
}

std::string CpuList::to_mask(int cpus) const {
    std::string text;
    for (int group = (cpus - 1) / 32; group >= 0; --group) {
        const auto bits =
            ((bits_ >> (32 * static_cast<std::size_t>(group))) & std::bitset<kLimit>{0xffffffffu}).to_ulong();
        std::array<char, 12> digits{};
        std::snprintf(digits.data(), digits.size(), text.empty() ? "%lx" : ",%08lx", bits);
        text += digits.data();
    }
    return text;
}

CpuList CpuList::without(const CpuList& others) const {
    CpuList rest = *this;
    rest.bits_ &= ~others.bits_;
    return rest;
}

}  // namespace qduino::board::linux
