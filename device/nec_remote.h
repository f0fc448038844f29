// A remote control with NEC's infrared code, as light that goes on and off.
//
//   in units of 562.5 µs: light 16, dark 8, then 32 bits: light 1, dark 1 (a zero) or 3 (a one),
//   and a last light of 1. While the key is held, every 110 ms: light 16, dark 4, light 1.
//
// Source: NEC, µPD6121 data sheet (remote control transmission code); SB-Projects, "NEC Protocol".
#pragma once

#include <cstdint>

#include "base/time.h"

namespace qduino::device {

class NecRemote {
  public:
    /// A key is pressed at `at`, and held for `repeats` more frames.
    constexpr NecRemote(Instant at, std::uint8_t address, std::uint8_t command, int repeats)
        : at_(at),
          bits_(std::uint32_t{address} | (0xFFu - address) << 8 | std::uint32_t{command} << 16 |
                (0xFFu - command) << 24),
          repeats_(repeats) {}

    /// True while the lamp is on. (The light is modulated; a receiver module does not show that.)
    [[nodiscard]] constexpr bool light(Instant now) const {
        if (now < at_) return false;
        const std::int64_t frame = (now - at_) / kPeriod;
        if (frame > repeats_) return false;
        std::int64_t unit = ((now - at_) % kPeriod).count() * 2 / 1'125'000;
        if (unit < 16) return true;
        unit -= 16 + (frame == 0 ? 8 : 4);
        if (unit < 0) return false;
        for (int bit = 0; bit < 32 && frame == 0; ++bit) {
            const int length = (bits_ >> bit & 1) != 0 ? 4 : 2;
            if (unit < length) return unit == 0;
            unit -= length;
        }
        return unit == 0;
    }

  private:
    static constexpr Nanoseconds kPeriod{110'000'000};

    Instant at_;
    std::uint32_t bits_;
    std::int64_t repeats_;
};

}  // namespace qduino::device
