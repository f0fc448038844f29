// Stands between the board and the twin, and forwards everything: a test overrides what it wants to
// change.
#pragma once

#include "board/peripherals.h"

namespace qduino::tests {

/// Must outlive the bench, whose board writes its pins until the end.
class ForwardingPins : public board::Peripherals {
  public:
    void forward_to(board::Peripherals& next) { next_ = &next; }
    void pin_written(Instant now, board::PinId pin, board::Level level) override {
        next_->pin_written(now, pin, level);
    }
    void pwm_written(Instant now, board::PinId pin, double duty) override {
        next_->pwm_written(now, pin, duty);
    }
    board::Level pin_level(Instant now, board::PinId pin) override { return next_->pin_level(now, pin); }
    double analog_level(Instant now, board::PinId pin) override { return next_->analog_level(now, pin); }
    Result<void> i2c_transfer(Instant now, board::I2cBus bus, board::I2cAddress address,
                              std::span<const std::uint8_t> out, std::span<std::uint8_t> in) override {
        return next_->i2c_transfer(now, bus, address, out, in);
    }
    Result<void> spi_transfer(Instant now, board::SpiBus bus, board::SpiSettings settings,
                              std::span<std::uint8_t> data) override {
        return next_->spi_transfer(now, bus, settings, data);
    }

  protected:
    board::Peripherals* next_ = nullptr;
};

}  // namespace qduino::tests
