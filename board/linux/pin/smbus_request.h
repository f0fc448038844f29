// Translates a plain I2C transaction into an SMBus request, for adapters that speak SMBus only.
//
// Source: System Management Bus specification 2.0, 5.5 "Bus protocols". Words travel low byte
// first.
#pragma once

#include <linux/i2c.h>

#include <cstdint>
#include <optional>
#include <span>

namespace qduino::board::linux {

struct SmbusRequest {
    char direction = I2C_SMBUS_WRITE;  ///< I2C_SMBUS_READ or I2C_SMBUS_WRITE
    std::uint8_t command = 0;
    std::uint32_t size = I2C_SMBUS_QUICK;  ///< I2C_SMBUS_QUICK, _BYTE, _BYTE_DATA or _WORD_DATA
    std::uint16_t data = 0;                ///< to be written
    bool operator==(const SmbusRequest&) const = default;
};

/// The request that puts the same bits on the wire as writing `out` and then, after a repeated
/// start, reading `in_size` bytes. There is one for 0 + 0 (is a chip there?), 0 + 1, 1 + 0, 1 + 1,
/// 1 + 2, 2 + 0 and 3 + 0 bytes; nothing for others.
inline std::optional<SmbusRequest> smbus_request(std::span<const std::uint8_t> out, std::size_t in_size) {
    const std::uint8_t command = out.empty() ? std::uint8_t{0} : out[0];
    if (out.empty() && in_size == 0) return SmbusRequest{};
    if (out.empty() && in_size == 1) return SmbusRequest{I2C_SMBUS_READ, 0, I2C_SMBUS_BYTE, 0};
    if (out.size() == 1 && in_size == 0) return SmbusRequest{I2C_SMBUS_WRITE, command, I2C_SMBUS_BYTE, 0};
    if (out.size() == 1 && in_size == 1) return SmbusRequest{I2C_SMBUS_READ, command, I2C_SMBUS_BYTE_DATA, 0};
    if (out.size() == 1 && in_size == 2) return SmbusRequest{I2C_SMBUS_READ, command, I2C_SMBUS_WORD_DATA, 0};
    if (out.size() == 2 && in_size == 0)
        return SmbusRequest{I2C_SMBUS_WRITE, command, I2C_SMBUS_BYTE_DATA, out[1]};
    if (out.size() == 3 && in_size == 0) {
        const auto word = static_cast<std::uint16_t>(out[1] | (out[2] << 8));
        return SmbusRequest{I2C_SMBUS_WRITE, command, I2C_SMBUS_WORD_DATA, word};
    }
    return std::nullopt;
}

}  // namespace qduino::board::linux
