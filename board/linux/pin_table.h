// Which driver stands behind each pin and each bus, and the safe states of all of them.
//
//   pin  0 … 127 ──►  VirtualPins · GpioPin · PwmPin · AnalogPin · nothing
//   I2C  0 … 15  ──►  VirtualPins · I2cDevice · nothing          (pin_driver.h)
//   SPI  0 … 15  ──►  VirtualPins · SpiDevice · nothing
//
// Decided once, when the board opens: with a file of virtual pins everything is virtual, but what
// the configuration names.
#pragma once

#include <array>
#include <atomic>
#include <memory>
#include <vector>

#include "base/result.h"
#include "board/linux/linux_config.h"
#include "board/linux/pin_driver.h"
#include "board/linux/virtual_pins.h"

namespace qduino::board::linux {

class PinTable {
  public:
    /// Opens every device that `config` names. Setup-time. Error: the first that cannot be had, by
    /// name.
    Result<void> open(const LinuxConfig& config);

    /// Null: nothing is behind it.
    [[nodiscard]] PinDriver* at(PinId pin) const {
        return pin.number < kPinCount ? pins_[pin.number] : nullptr;
    }
    [[nodiscard]] I2cDriver* at(I2cBus bus) const {
        return bus.number < kBusLimit ? i2c_[bus.number] : nullptr;
    }
    [[nodiscard]] SpiDriver* at(SpiBus bus) const {
        return bus.number < kBusLimit ? spi_[bus.number] : nullptr;
    }

    /// The virtual ones; attached when there is a file of them.
    [[nodiscard]] VirtualPins& virtual_pins() { return virtual_; }
    [[nodiscard]] const VirtualPins& virtual_pins() const { return virtual_; }

    /// Remembers a safe state, and tells a supervisor of it. Setup-time.
    Result<void> set_safe_state(PinId pin, Level level);
    /// Forces all of them. Async-signal-safe; only the first call does.
    void force_safe_states();

  private:
    static constexpr std::size_t kBusLimit = 16;

    Result<void> open_pins(const LinuxConfig& config);
    Result<void> open_buses(const LinuxConfig& config);
    template <typename Driver>
    Result<void> add_pin(PinId pin, std::unique_ptr<Driver> driver);

    VirtualPins virtual_;
    std::vector<std::unique_ptr<PinDriver>> real_pins_;
    std::vector<std::unique_ptr<I2cDriver>> real_i2c_;
    std::vector<std::unique_ptr<SpiDriver>> real_spi_;
    std::array<PinDriver*, kPinCount> pins_{};
    std::array<I2cDriver*, kBusLimit> i2c_{};
    std::array<SpiDriver*, kBusLimit> spi_{};
    std::atomic<bool> made_safe_{false};
};

}  // namespace qduino::board::linux
