// A PL031: a counter of seconds that runs without power, and is set to those since 1970. One that
// nobody has set counts from the computer's begin, and the date is 1970.
//
//   +0x00   the seconds
//   +0x0c   bit 0: it counts
//
// PrimeCell Real Time Clock (PL031) Technical Reference Manual (Arm DDI 0224B), 3.3. Untested on
// silicon.
#pragma once

#include <cstdint>
#include <optional>

#include "board/metal/computer/instructions.h"

namespace qduino::board::metal {

/// Seconds since 1970. `at`: where its registers are; 0: there is none. Nothing: no counter runs
/// there.
[[nodiscard]] inline std::optional<std::int64_t> read_pl031_date(std::uint64_t at) {
    constexpr std::uint64_t kNow = 0, kControl = 0x0c;
    if (at == 0 || (memory_read(at + kControl) & 1) == 0) return std::nullopt;
    return memory_read(at + kNow);
}

}  // namespace qduino::board::metal
