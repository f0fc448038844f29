#include "board/linux/pin/pin_table.h"

#include "board/linux/pin/bus_device.h"
#include "board/linux/pin/gpio_pin.h"
#include "board/linux/pin/sysfs_pin.h"

namespace qduino::board::linux {

PinTable::PinTable() {
    pins_.fill(&no_pin_);
    i2c_.fill(&no_i2c_);
    spi_.fill(&no_spi_);
}

Result<void> PinTable::open(const LinuxConfig& config) {
    if (!config.pins_path.empty()) {
        QDUINO_TRY(virtual_.attach(config.pins_path));
        std::fill_n(pins_.begin(), kPinCount, &virtual_);
        std::fill_n(i2c_.begin(), kBusLimit, &virtual_);
        std::fill_n(spi_.begin(), kBusLimit, &virtual_);
    }
    QDUINO_TRY(open_pins(config));
    const auto add_bus = [](const auto& port, auto device, auto& buses, auto& owned) -> Result<void> {
        if (port.bus.number >= kBusLimit)
            return make_error(ErrorCode::invalid_argument, "the number of an I2C or SPI bus is below 16");
        QDUINO_TRY(device->open(port));
        buses[port.bus.number] = device.get();
        owned.push_back(std::move(device));
        return {};
    };
    for (const I2cPort& port : config.i2c)
        QDUINO_TRY(add_bus(port, std::make_unique<I2cDevice>(), i2c_, real_i2c_));
    for (const SpiPort& port : config.spi)
        QDUINO_TRY(add_bus(port, std::make_unique<SpiDevice>(), spi_, real_spi_));
    return {};
}

template <typename Driver>
Result<void> PinTable::add_pin(PinId pin, std::unique_ptr<Driver> driver) {
    if (pin.number >= kPinCount) return make_error(ErrorCode::invalid_argument, "a pin number is below 128");
    QDUINO_TRY(driver->open());
    pins_[pin.number] = driver.get();
    real_pins_.push_back(std::move(driver));
    return {};
}

Result<void> PinTable::open_pins(const LinuxConfig& config) {
    for (const GpioLine& line : config.gpio) {
        QDUINO_TRY(add_pin(line.pin, std::make_unique<GpioPin>(line)));
        if (virtual_.attached()) virtual_.publish_line(line.pin, {line.chip, line.line});
    }
    for (const PwmChannel& channel : config.pwm) {
        QDUINO_TRY(add_pin(channel.pin, std::make_unique<PwmPin>(channel, config.sysfs_root)));
        if (virtual_.attached()) virtual_.publish_channel(channel.pin, {channel.chip, channel.channel});
    }
    for (const AnalogChannel& channel : config.analog) {
        QDUINO_TRY(add_pin(channel.pin, std::make_unique<AnalogPin>(channel, config.sysfs_root)));
    }
    return {};
}

Result<void> PinTable::set_safe_state(PinId pin, Level level) {
    PinDriver& driver = at(pin);
    if (virtual_.attached() && &driver != &virtual_ && &driver != &no_pin_)
        virtual_.publish_safe_state(pin, level);
    return driver.set_safe_state(pin, level);
}

void PinTable::force_safe_states() {
    if (made_safe_.exchange(true)) return;
    virtual_.force_safe_states();
    for (const auto& driver : real_pins_) driver->force_safe_states();
}

}  // namespace qduino::board::linux
