// The CRC of the 1-Wire bus: x⁸ + x⁵ + x⁴ + 1, the lowest bit first. (Maxim, application note 27.)
#pragma once

#include <cstdint>
#include <span>

namespace qduino::device {

/// The CRC of `bytes`; 0 for bytes that end with their own CRC.
constexpr std::uint8_t one_wire_crc(std::span<const std::uint8_t> bytes) {
    std::uint8_t crc = 0;
    for (const std::uint8_t value : bytes) {
        crc = static_cast<std::uint8_t>(crc ^ value);
        for (int bit = 0; bit < 8; ++bit)
            crc = static_cast<std::uint8_t>((crc >> 1) ^ ((crc & 1) != 0 ? 0x8C : 0));
    }
    return crc;
}

}  // namespace qduino::device
