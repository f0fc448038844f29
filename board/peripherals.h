// What is wired to a board's pins when they are virtual: chips, motors, a whole printer.
//
// A virtual board calls these with the instant at which the electrical event happens. Calls come in
// the order of their instants, from one thread. Nothing but pins and buses crosses here, so what a
// twin finds out about a print is a proof from the pins alone.
#pragma once

#include <bitset>
#include <cstdint>
#include <span>

#include "base/result.h"
#include "board/types.h"

namespace qduino::board {

/// Peripherals report here what the board did not ask for.
class PinEdgeSink {
  public:
    virtual ~PinEdgeSink() = default;
    /// The outside drives `level` onto `pin` from `now` on: the instant of the call being served,
    /// or of the event that next_event() announced. A level that it has already is no edge. Only
    /// from inside a call that the board made to its peripherals.
    virtual void pin_edge(Instant now, PinId pin, Level level) = 0;
};

class Peripherals {
  public:
    virtual ~Peripherals() = default;

    /// Gives the peripherals a place to report edges to, before any other call. True: they will
    /// report every change of an input. False: the board must look at the inputs itself, at its
    /// polling interval.
    [[nodiscard]] virtual bool report_edges_to(PinEdgeSink& /*sink*/) { return false; }
    /// Advances the physics to `now`, an instant that next_event() announced.
    virtual void advance(Instant /*now*/) {}

    /// The board drives `pin` to `level` (called on every write, changed or not).
    virtual void pin_written(Instant now, PinId pin, Level level) = 0;
    /// The board drives `pin` no more: it has become an input. The simulator says so; behind a file
    /// of virtual pins nobody does.
    virtual void pin_released(Instant /*now*/, PinId /*pin*/) {}
    /// The board's resistor pulls the input `pin` up from now on, or no longer. Where nothing else
    /// drives the pin it reads high with it.
    virtual void pin_pulled_up(Instant /*now*/, PinId /*pin*/, bool /*up*/) {}
    /// The board's PWM output on `pin` has this duty (0…1) from now on.
    virtual void pwm_written(Instant now, PinId pin, double duty) = 0;
    /// The board's PWM output on `pin` has this period from now on; 0: the board's own. Most
    /// peripherals need only the duty.
    virtual void pwm_period_set(Instant /*now*/, PinId /*pin*/, Nanoseconds /*period*/) {}
    /// The level that the outside drives onto `pin`.
    [[nodiscard]] virtual Level pin_level(Instant now, PinId pin) = 0;
    /// Voltage on an analog pin as a fraction (0…1) of the reference.
    [[nodiscard]] virtual double analog_level(Instant now, PinId pin) = 0;
    /// One I2C transaction: writes `out`, then, after a repeated start, reads `in.size()` bytes.
    /// Error: timed_out when no chip answers the address.
    [[nodiscard]] virtual Result<void> i2c_transfer(Instant now, I2cBus bus, I2cAddress address,
                                                    std::span<const std::uint8_t> out,
                                                    std::span<std::uint8_t> in) = 0;
    /// One full-duplex SPI transfer in place.
    [[nodiscard]] virtual Result<void> spi_transfer(Instant now, SpiBus bus, SpiSettings settings,
                                                    std::span<std::uint8_t> data) = 0;
    /// The latest instant up to which the physics must be advanced even if no pin changes; kForever
    /// when nothing is due.
    [[nodiscard]] virtual Instant next_event(Instant /*now*/) { return kForever; }
};

/// A board with nothing wired to it: inputs read low, or high where they are pulled up; no chip
/// answers. Also the base of peripherals
/// that only look at some of this.
class NoPeripherals : public Peripherals {
  public:
    void pin_written(Instant, PinId, Level) override {}
    void pin_pulled_up(Instant, PinId pin, bool up) override { pulled_up_.set(pin.number, up); }
    void pwm_written(Instant, PinId, double) override {}
    Level pin_level(Instant, PinId pin) override {
        return pulled_up_.test(pin.number) ? Level::high : Level::low;
    }
    double analog_level(Instant, PinId) override { return 0.0; }
    Result<void> i2c_transfer(Instant, I2cBus, I2cAddress, std::span<const std::uint8_t>,
                              std::span<std::uint8_t>) override {
        return make_error(ErrorCode::timed_out,
                          "no chip answers at this I2C address: check wiring and address");
    }
    Result<void> spi_transfer(Instant, SpiBus, SpiSettings, std::span<std::uint8_t>) override { return {}; }

  private:
    std::bitset<kPinCount> pulled_up_;
};

/// Stands between a board and `next`, and forwards everything, so that another may override what it
/// wants to see or to change. forward_to() comes before any other call; `next` outlives the board.
class ForwardingPeripherals : public Peripherals {
  public:
    void forward_to(Peripherals& next) { next_ = &next; }
    bool report_edges_to(PinEdgeSink& sink) override { return next_->report_edges_to(sink); }
    void advance(Instant now) override { next_->advance(now); }
    void pin_written(Instant now, PinId pin, Level level) override { next_->pin_written(now, pin, level); }
    void pin_released(Instant now, PinId pin) override { next_->pin_released(now, pin); }
    void pin_pulled_up(Instant now, PinId pin, bool up) override { next_->pin_pulled_up(now, pin, up); }
    void pwm_written(Instant now, PinId pin, double duty) override { next_->pwm_written(now, pin, duty); }
    void pwm_period_set(Instant now, PinId pin, Nanoseconds period) override {
        next_->pwm_period_set(now, pin, period);
    }
    Level pin_level(Instant now, PinId pin) override { return next_->pin_level(now, pin); }
    double analog_level(Instant now, PinId pin) override { return next_->analog_level(now, pin); }
    Result<void> i2c_transfer(Instant now, I2cBus bus, I2cAddress address, std::span<const std::uint8_t> out,
                              std::span<std::uint8_t> in) override {
        return next_->i2c_transfer(now, bus, address, out, in);
    }
    Result<void> spi_transfer(Instant now, SpiBus bus, SpiSettings settings,
                              std::span<std::uint8_t> data) override {
        return next_->spi_transfer(now, bus, settings, data);
    }
    Instant next_event(Instant now) override { return next_->next_event(now); }

  private:
    Peripherals* next_ = nullptr;
};

}  // namespace qduino::board
