// Which driver stands behind each pin and each bus, and the safe states of all of them.
//
//   pin  0 … 127 ──►  VirtualPins · GpioPin · PwmPin · AnalogPin · nothing
//   I2C  0 … 15  ──►  VirtualPins · I2cDevice · nothing          (pin_driver.h)
//   SPI  0 … 15  ──►  VirtualPins · SpiDevice · nothing
//
// Decided once, when the board opens: with a file of virtual pins everything is virtual, but what
// the configuration names.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <memory>
#include <span>
#include <vector>

#include "base/result.h"
#include "board/linux/kernel/linux_config.h"
#include "board/linux/pin/pin_driver.h"
#include "board/linux/pin/virtual_pins.h"

namespace qduino::board::linux {

class PinTable {
  public:
    PinTable();

    /// Opens every device that `config` names. Setup-time. Error: the first that cannot be had, by
    /// name.
    Result<void> open(const LinuxConfig& config);

    [[nodiscard]] PinDriver& at(PinId pin) { return *pins_[std::min(pin.number, kPinCount)]; }
    [[nodiscard]] I2cDriver& at(I2cBus bus) { return *i2c_[std::min(bus.number, kBusLimit)]; }
    [[nodiscard]] SpiDriver& at(SpiBus bus) { return *spi_[std::min(bus.number, kBusLimit)]; }

    /// All of them to `level`; neighbours that have one driver in one call of it.
    void write(VcpuId vcpu, std::span<const PinId> pins, Level level) {
        if (pins.size() == 1) return at(pins[0]).write(vcpu, pins[0], level);  // the quickest way
        for (std::size_t begin = 0, end = 0; begin < pins.size(); begin = end) {
            PinDriver& driver = at(pins[begin]);
            for (end = begin + 1; end < pins.size() && &at(pins[end]) == &driver;) ++end;
            driver.write_all(vcpu, pins.subspan(begin, end - begin), level);
        }
    }

    /// The virtual ones; attached when there is a file of them.
    [[nodiscard]] VirtualPins& virtual_pins() { return virtual_; }
    [[nodiscard]] const VirtualPins& virtual_pins() const { return virtual_; }

    /// Remembers a safe state, and tells a supervisor of it. Setup-time.
    Result<void> set_safe_state(PinId pin, Level level);
    /// Forces all of them. Async-signal-safe; only the first call does.
    void force_safe_states();

  private:
    static constexpr std::uint8_t kBusLimit = 16;

    Result<void> open_pins(const LinuxConfig& config);
    template <typename Driver>
    Result<void> add_pin(PinId pin, std::unique_ptr<Driver> driver);

    VirtualPins virtual_;
    std::vector<std::unique_ptr<PinDriver>> real_pins_;
    std::vector<std::unique_ptr<I2cDriver>> real_i2c_;
    std::vector<std::unique_ptr<SpiDriver>> real_spi_;
    NoPin no_pin_;
    I2cDriver no_i2c_;
    SpiDriver no_spi_;
    // The last of each is for numbers that are too high: nothing, always.
    std::array<PinDriver*, kPinCount + 1> pins_;
    std::array<I2cDriver*, kBusLimit + 1> i2c_;
    std::array<SpiDriver*, kBusLimit + 1> spi_;
    std::atomic<bool> made_safe_{false};
};

}  // namespace qduino::board::linux
