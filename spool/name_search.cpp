#include "spool/name_search.h"

#include <array>
#include <span>

namespace qduino::spool {

namespace {

/// The simple lower case of a code point of two UTF-8 bytes, itself one of two bytes.
unsigned lower(unsigned code) {
    if (code >= 0xC0 && code <= 0xDE && code != 0xD7) return code + 0x20;
    if (code == 0x178) return 0xFF;
    const bool upper_is_even =
        (code >= 0x100 && code <= 0x137 && code != 0x130) || (code >= 0x14A && code <= 0x177);
    if (upper_is_even) return code | 1U;
    const bool upper_is_odd = (code >= 0x139 && code <= 0x148) || (code >= 0x179 && code <= 0x17E);
    if (upper_is_odd) return code + (code & 1U);
    if (code >= 0x391 && code <= 0x3A9 && code != 0x3A2) return code + 0x20;
    if (code >= 0x410 && code <= 0x42F) return code + 0x20;
    if (code >= 0x400 && code <= 0x40F) return code + 0x50;
    return code;
}

/// In place: here no lower case has another length.
void fold(std::span<char> out) {
    for (std::size_t i = 0; i < out.size(); ++i) {
        const auto lead = static_cast<unsigned char>(out[i]);
        if (lead < 0x80) {
            if (lead >= 'A' && lead <= 'Z') out[i] = static_cast<char>(lead | 0x20);
            continue;
        }
        const bool pair = lead >= 0xC2 && lead <= 0xDF && i + 1 < out.size() &&
                          (static_cast<unsigned char>(out[i + 1]) & 0xC0) == 0x80;
        if (!pair) continue;
        const unsigned code = lower((lead & 0x1FU) << 6 | (static_cast<unsigned char>(out[i + 1]) & 0x3FU));
        out[i] = static_cast<char>(0xC0 | code >> 6);
        out[++i] = static_cast<char>(0x80 | (code & 0x3F));
    }
}

}  // namespace

std::string folded(std::string_view text) {
    std::string out{text};
    fold(out);
    return out;
}

bool name_holds(std::string_view name, std::string_view folded_part) {
    // Called for every job of a long list: a name that a job may have needs no allocation.
    std::array<char, 200> lower_name;
    if (name.size() > lower_name.size()) return folded(name).find(folded_part) != std::string::npos;
    const std::span<char> lower = std::span{lower_name}.first(name.copy(lower_name.data(), name.size()));
    fold(lower);
    return std::string_view{lower.data(), lower.size()}.find(folded_part) != std::string_view::npos;
}

}  // namespace qduino::spool
