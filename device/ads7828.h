// ADS7828: the driver's side of a 12-bit, 8-channel analog-to-digital converter on I2C.
//
// Source: Texas Instruments, ADS7828 data sheet (SBAS181), "Address byte", "Command byte", "Reading
// data".
//
//   one conversion on the wire (S start, Sr repeated start, A acknowledge, N none, P stop):
//
//     S  1001 0 A1 A0 W  A   SD C2 C1 C0 PD1 PD0 x x  A
//                            └──── command byte ───┘
//     Sr 1001 0 A1 A0 R  A   0 0 0 0 D11 D10 D9 D8  A   D7 D6 D5 D4 D3 D2 D1 D0  N  P
//                            └──────────────── two result bytes ───────────────┘
//
// The channel number does not go into the byte unchanged: its lowest bit goes to C2, its upper two
// bits to C1 C0. (The channels come in differential pairs, and C2 picks the side of the pair.)
//
// Nothing here does I/O: the caller owns the bus. The chip's side is ads7828_chip.h.
#pragma once

#include <cstdint>
#include <span>

#include "base/contract.h"

namespace qduino::device::ads7828 {

inline constexpr int kChannelCount = 8;
/// A result r means r / kFullScale of the reference.
inline constexpr int kFullScale = 4096;
inline constexpr std::uint8_t kFirstAddress = 0x48;  ///< A1 = A0 = 0; the pins add 0…3

/// The command byte that starts a single-ended conversion of `channel` (0…7) against COM. PD1 PD0
/// are 0: the converter sleeps between conversions, and the reference is the REF pin.
constexpr std::uint8_t command_byte(int channel) {
    QDUINO_EXPECT(channel >= 0 && channel < kChannelCount);
    const unsigned c = static_cast<unsigned>(channel);
    const unsigned select = ((c & 1u) << 2) | (c >> 1);
    return static_cast<std::uint8_t>(0x80u | (select << 4));
}

/// The 12-bit result in the two bytes read; the four leading bits are zero on the wire and ignored
/// here.
constexpr int decode(std::span<const std::uint8_t, 2> bytes) { return ((bytes[0] & 0x0F) << 8) | bytes[1]; }

/// The result as a fraction of the reference, at the middle of its step: never exactly 0 or 1.
constexpr double fraction(int result) { return (static_cast<double>(result) + 0.5) / kFullScale; }

}  // namespace qduino::device::ads7828
