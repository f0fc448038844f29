// What a board file wires to the simulated board. Between the board and the chips (device/):
//
//   pin 2 ──┬── Hx711Chip          a level is high, unless a part on the line pulls it low
//   pin 4 ──┼── Ds18b20Chip
//           └── Ds18b20Chip
//   I2C 0, 0x3C ── Ssd1306Chip
//   pin 7 ──┴── infrared receiver  sees NecRemote, and an LED on a pin of its own
//   pin 6 ──┬── Ws2812Chip         on pin 51, the bits of SPI 0 reach it as well
//
// Without parts it is a board with nothing wired to it: inputs read low, no chip answers.
#pragma once

#include <array>
#include <bitset>
#include <memory>
#include <string>
#include <vector>

#include "board/peripherals.h"
#include "config/part_list.h"

namespace qduino::apps {

/// One chip on its pins or its bus.
class Part {
  public:
    virtual ~Part() = default;
    /// The board drives `pin` to this level; high as well where it has let go of it.
    virtual void driven(Instant /*now*/, board::PinId /*pin*/, bool /*high*/) {}
    /// The board's PWM on `pin` has this duty.
    virtual void dimmed(Instant /*now*/, board::PinId /*pin*/, double /*duty*/) {}
    /// True while it pulls `pin` low.
    [[nodiscard]] virtual bool pulls_low(Instant /*now*/, board::PinId /*pin*/) { return false; }
    /// Time has come to this; called before report().
    virtual void settle(Instant /*now*/) {}
    /// False: this is not its address.
    [[nodiscard]] virtual bool transferred(board::I2cBus, board::I2cAddress, std::span<const std::uint8_t>,
                                           std::span<std::uint8_t>) {
        return false;
    }
    /// A line on what it did, with its end.
    [[nodiscard]] virtual std::string report() const = 0;
    /// Writes its picture, if it has one.
    [[nodiscard]] virtual Result<void> finish() const { return {}; }
};

class Parts final : public board::Peripherals {
  public:
    explicit Parts(const std::vector<PartSpec>& list);

    void pin_written(Instant now, board::PinId pin, board::Level level) override;
    void pin_released(Instant now, board::PinId pin) override;
    void pin_pulled_up(Instant /*now*/, board::PinId pin, bool up) override {
        pulled_up_.set(pin.number, up);
    }
    void pwm_written(Instant now, board::PinId pin, double duty) override;
    [[nodiscard]] board::Level pin_level(Instant now, board::PinId pin) override;
    [[nodiscard]] double analog_level(Instant, board::PinId) override { return 0.0; }
    [[nodiscard]] Result<void> i2c_transfer(Instant now, board::I2cBus bus, board::I2cAddress address,
                                            std::span<const std::uint8_t> out,
                                            std::span<std::uint8_t> in) override;
    /// The bits come out of pin 51, MOSI, one for each period of the clock; nobody answers.
    [[nodiscard]] Result<void> spi_transfer(Instant now, board::SpiBus bus, board::SpiSettings settings,
                                            std::span<std::uint8_t> data) override;

    /// A line for each part, as it is at `now`. Empty: there are none.
    [[nodiscard]] std::string report(Instant now) const;
    /// Writes the pictures. Error: the first that could not be written.
    [[nodiscard]] Result<void> finish() const;

  private:
    void wire(board::PinId pin, Part& part) { on_pin_[pin.number].push_back(&part); }

    std::vector<std::unique_ptr<Part>> parts_;
    std::array<std::vector<Part*>, board::kPinCount> on_pin_;
    std::bitset<board::kPinCount> pulled_up_;
};

}  // namespace qduino::apps
