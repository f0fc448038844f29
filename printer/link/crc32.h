// CRC-32 as Ethernet and zlib compute it: polynomial 0x04C11DB7 reflected (0xEDB88320), start and
// final inversion. (ISO/IEC 13239, annex A; check value of "123456789" is 0xCBF43926.)
//
// It finds accidents (a torn write, a stray pointer, an old layout), not attackers.
#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace qduino::printer::link {

namespace detail {

constexpr std::array<std::uint32_t, 256> make_crc32_table() {
    std::array<std::uint32_t, 256> table{};
    for (std::uint32_t byte = 0; byte < 256; ++byte) {
        std::uint32_t value = byte;
        for (int bit = 0; bit < 8; ++bit) value = (value & 1u) ? (value >> 1) ^ 0xEDB88320u : value >> 1;
        table[byte] = value;
    }
    return table;
}

inline constexpr std::array<std::uint32_t, 256> kCrc32Table = make_crc32_table();

}  // namespace detail

/// The check sum of `bytes`, continued from `before`, the check sum of what precedes them (0:
/// nothing).
constexpr std::uint32_t crc32(std::span<const std::uint8_t> bytes, std::uint32_t before = 0) {
    std::uint32_t value = ~before;
    for (const std::uint8_t byte : bytes) value = detail::kCrc32Table[(value ^ byte) & 0xFFu] ^ (value >> 8);
    return ~value;
}

}  // namespace qduino::printer::link
