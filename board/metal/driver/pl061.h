// A PL061: eight pins, 0 to 7. Untested on silicon.
//
//   a word at 4·mask from its begin: the levels of the pins whose bit is in the mask. So a write of
//   one pin is one store, and needs no lock
//
// PrimeCell General Purpose Input/Output (PL061) Technical Reference Manual (Arm DDI 0190B), 3.3.
#pragma once

#include <cstdint>

#include "board/metal/core/device_interrupts.h"
#include "board/metal/driver/pin_port.h"

namespace qduino::board::metal {

class Pl061 final : public PinPort, public Device {
  public:
    static constexpr std::uint16_t kPins = 8;

    /// `at`: where its registers are. All pins are inputs, and none interrupts.
    explicit Pl061(std::uint64_t at);

    [[nodiscard]] Result<void> set_mode(PinId pin, PinMode mode, Level level) override;
    void write(PinId pin, Level level) override;
    [[nodiscard]] Level read(PinId pin) override;
    [[nodiscard]] bool reports_edges() const override { return true; }

    void quiet() override;

  private:
    void serve() override;
    void report(PinId pin);

    std::uint64_t at_;
    PortLock lock_;                 // of the registers below, which all pins share
    std::uint32_t directions_ = 0;  // a bit for each output
    std::uint32_t listens_ = 0;     // a bit for each input: it interrupts at both edges
    std::uint32_t levels_ = 0;      // of inputs, as they were reported
    bool quiet_ = false;            // until it was served
};

}  // namespace qduino::board::metal
