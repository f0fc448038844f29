// The parts that a board file wires to the simulated board: [[part]] (docs/board-file.md).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/time.h"
#include "board/types.h"

namespace qduino::apps {

enum class Chip : std::uint8_t { hx711, ds18b20, ssd1306, ws2812, ir };

/// One part. Each chip has a few of these; the board file's reader knows which.
struct PartSpec {
    Chip chip = Chip::hx711;
    board::PinId data{}, clock{};
    std::int32_t value = 0, value_b = 0;  ///< hx711: what its inputs read, in steps
    double celsius = 20;                  ///< ds18b20
    std::uint64_t serial = 1;             ///< ds18b20: 48 bits
    board::I2cBus bus{};
    board::I2cAddress address{0x3C};
    /// ir: what shines on it.
    struct Light {
        board::PinId led{board::kPinCount};  ///< of the board; this one: none
        Instant at = kForever;               ///< when somebody presses a key …
        int remote = 0, command = 0;         ///< … of this remote control, …
        int repeats = 0;                     ///< … and holds it for so many frames
    };
    Light light{};
    int pixels = 8;   ///< ws2812
    int height = 64;  ///< ssd1306: rows, 64 or 32
    /// ssd1306: a file (PBM) for what it shows in the end; empty: none.
    std::string picture{};
};

}  // namespace qduino::apps
