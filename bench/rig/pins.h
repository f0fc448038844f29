// A file of virtual pins of this process, and a machine at the other end of it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "board/linux/pins_server.h"
#include "board/peripherals.h"

namespace qduino::bench {

/// Pins alone: no chip answers.
class BareMachine : public board::Peripherals {
  public:
    void pwm_written(Instant, board::PinId, double) override {}
    board::Level pin_level(Instant, board::PinId) override { return board::Level::low; }
    double analog_level(Instant, board::PinId) override { return 0; }
    Result<void> i2c_transfer(Instant, board::I2cBus, board::I2cAddress, std::span<const std::uint8_t>,
                              std::span<std::uint8_t>) override {
        return make_error(ErrorCode::timed_out, "nothing is wired here");
    }
    Result<void> spi_transfer(Instant, board::SpiBus, board::SpiSettings, std::span<std::uint8_t>) override {
        return {};
    }
};

class Pins {
  public:
    /// In /dev/shm. `machine` sees the edges, and outlives this.
    explicit Pins(board::Peripherals& machine);
    ~Pins();
    Pins(const Pins&) = delete;
    Pins& operator=(const Pins&) = delete;

    [[nodiscard]] bool ready() const { return server_.has_value(); }
    [[nodiscard]] const std::string& path() const { return path_; }
    /// Shows the machine all that was written until now.
    void poll();
    /// Edges that found their ring full.
    [[nodiscard]] std::uint64_t lost() const { return server_->faults().lost; }

  private:
    board::Peripherals& machine_;
    std::string path_;
    std::optional<board::linux::PinsServer> server_;
};

}  // namespace qduino::bench
