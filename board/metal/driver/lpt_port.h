// The parallel port of a PC. A pin's number is that of the connector's (DB25).
//
//   register         bit   7    6    5    4    3    2    1    0
//   +0 data                9    8    7    6    5    4    3    2     outputs
//   +1 status            (11)  10   12   13   15                    inputs
//   +2 control                                 (17)  16  (14)  (1)  outputs
//
// In brackets: the port inverts it, which is undone here: a level is the connector's. Pins 18 to 25
// are ground. IEEE 1284-1994, 6.1 (compatibility mode) and annex C (connector 1284-A); registers:
// PC87306 SuperI/O datasheet (National Semiconductor), parallel port, SPP mode.
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>

#include "board/metal/driver/pin_port.h"

namespace qduino::board::metal {

/// How a byte goes to a port of the computer, and comes from it.
struct PortAccess {
    void (*write)(std::uint16_t port, std::uint8_t value);
    std::uint8_t (*read)(std::uint16_t port);
};

class LptPort final : public PinPort {
  public:
    static constexpr std::uint16_t kFirstPort = 0x378;  ///< where firmwares put the first one

    constexpr explicit LptPort(PortAccess ports, std::uint16_t base = kFirstPort)
        : ports_(ports), base_(base) {}

    /// Drives every output low. False: no port answers there.
    [[nodiscard]] bool open();

    [[nodiscard]] Result<void> set_mode(PinId pin, PinMode mode, Level level) override;
    void write(PinId pin, Level level) override;
    [[nodiscard]] Level read(PinId pin) override;

  private:
    /// Where a pin of the connector is.
    struct Place {
        std::uint8_t offset;  // of its register
        std::uint8_t bit;
        bool inverted;
    };
    static std::optional<Place> place_of(PinId pin);
    static bool is_output_of_port(const Place& place);

    PortAccess ports_;
    std::uint16_t base_;
    PortLock lock_;
    // What the two registers of outputs hold: a read of them costs a microsecond.
    std::uint8_t data_ = 0, control_ = 0;
};

}  // namespace qduino::board::metal
