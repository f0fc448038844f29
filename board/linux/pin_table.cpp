#include "board/linux/pin_table.h"

#include "board/linux/bus_device.h"
#include "board/linux/gpio_pin.h"
#include "board/linux/sysfs_pin.h"

namespace qduino::board::linux {

Result<void> PinTable::open(const LinuxConfig& config) {
    if (!config.pins_path.empty()) {
        if (auto attached = virtual_.attach(config.pins_path); !attached) return attached;
        pins_.fill(&virtual_);
        i2c_.fill(&virtual_);
        spi_.fill(&virtual_);
    }
    if (auto opened = open_pins(config); !opened) return opened;
    return open_buses(config);
}

template <typename Driver>
Result<void> PinTable::add_pin(PinId pin, std::unique_ptr<Driver> driver) {
    if (pin.number >= kPinCount) return make_error(ErrorCode::invalid_argument, "a pin number is below 128");
    if (auto opened = driver->open(); !opened) return opened;
    pins_[pin.number] = driver.get();
    real_pins_.push_back(std::move(driver));
    return {};
}

Result<void> PinTable::open_pins(const LinuxConfig& config) {
    for (const GpioLine& line : config.gpio) {
        if (auto added = add_pin(line.pin, std::make_unique<GpioPin>(line)); !added) return added;
        if (virtual_.attached()) virtual_.publish_line(line.pin, line.chip, line.line);
    }
    for (const PwmChannel& channel : config.pwm) {
        if (auto added = add_pin(channel.pin, std::make_unique<PwmPin>(channel, config.sysfs_root)); !added)
            return added;
        if (virtual_.attached()) virtual_.publish_channel(channel.pin, channel.chip, channel.channel);
    }
    for (const AnalogChannel& channel : config.analog) {
        auto added = add_pin(channel.pin, std::make_unique<AnalogPin>(channel, config.sysfs_root));
        if (!added) return added;
    }
    return {};
}

Result<void> PinTable::open_buses(const LinuxConfig& config) {
    for (const I2cPort& port : config.i2c) {
        if (port.bus.number >= kBusLimit)
            return make_error(ErrorCode::invalid_argument, "an I2C bus number is below 16");
        auto device = std::make_unique<I2cDevice>();
        if (auto opened = device->open(port); !opened) return opened;
        i2c_[port.bus.number] = device.get();
        real_i2c_.push_back(std::move(device));
    }
    for (const SpiPort& port : config.spi) {
        if (port.bus.number >= kBusLimit)
            return make_error(ErrorCode::invalid_argument, "an SPI bus number is below 16");
        auto device = std::make_unique<SpiDevice>();
        if (auto opened = device->open(port); !opened) return opened;
        spi_[port.bus.number] = device.get();
        real_spi_.push_back(std::move(device));
    }
    return {};
}

Result<void> PinTable::set_safe_state(PinId pin, Level level) {
    PinDriver* const driver = at(pin);
    if (!driver) return nothing_at(pin);
    if (virtual_.attached() && driver != &virtual_) virtual_.publish_safe_state(pin, level);
    return driver->set_safe_state(pin, level);
}

void PinTable::force_safe_states() {
    if (made_safe_.exchange(true)) return;
    virtual_.force_safe_states();
    for (const auto& driver : real_pins_) driver->force_safe_states();
}

}  // namespace qduino::board::linux
