// Drives the twin's pins as a careful firmware would: every pulse keeps the driver's timing. For
// the tests of the printer.
#pragma once

#include <array>
#include <cstdint>

#include "device/ads7828.h"
#include "twin/printer.h"

namespace qduino::twin::testing {

using board::Level;
using board::PinId;

class PinPlayer {
  public:
    explicit PinPlayer(Printer& printer) : printer_(printer) {}

    Instant now{};

    void wait(Nanoseconds duration) { now += duration; }

    /// One pulse: DIR 1 µs ahead when it must change, STEP high for `high`; then `interval` until
    /// the next may come.
    void step(int axis, int direction, Nanoseconds interval, Nanoseconds high = Nanoseconds{2000}) {
        const AxisSpec& spec = printer_.machine().axes[static_cast<std::size_t>(axis)];
        int& last = direction_[static_cast<std::size_t>(axis)];
        if (last != direction) {
            const bool level = (direction > 0) != spec.direction_inverted;
            printer_.pin_written(now, PinId{spec.direction_pin}, level ? Level::high : Level::low);
            now += Nanoseconds{1000};
            last = direction;
        }
        printer_.pin_written(now, PinId{spec.step_pin}, Level::high);
        printer_.pin_written(now + high, PinId{spec.step_pin}, Level::low);
        now += interval;
    }
    void steps(int axis, int direction, int count, Nanoseconds interval) {
        for (int i = 0; i < count; ++i) step(axis, direction, interval);
    }
    [[nodiscard]] bool pressed(int axis) {
        const std::uint16_t pin = printer_.machine().axes[static_cast<std::size_t>(axis)].endstop_pin;
        return printer_.pin_level(now, PinId{pin}) == Level::high;
    }
    /// Fast approach, retreat, slow approach, rest.
    void home(int axis) {
        const int per_mm =
            static_cast<int>(printer_.machine().axes[static_cast<std::size_t>(axis)].steps_per_mm);
        while (!pressed(axis)) step(axis, -1, Nanoseconds{200'000});
        wait(Nanoseconds{80'000'000});
        steps(axis, 1, per_mm, Nanoseconds{200'000});
        wait(Nanoseconds{30'000'000});
        while (!pressed(axis)) step(axis, -1, Nanoseconds{1'500'000});
        wait(Nanoseconds{50'000'000});
    }
    /// A conversion as the driver asks for it; −1 when no chip answers.
    [[nodiscard]] int convert(int channel) {
        const std::array<std::uint8_t, 1> command{device::ads7828::command_byte(channel)};
        std::array<std::uint8_t, 2> answer{};
        const Result<void> done =
            printer_.i2c_transfer(now, board::I2cBus{1}, board::I2cAddress{0x48}, command, answer);
        return done ? device::ads7828::decode(answer) : -1;
    }
    /// Degrees as the driver computes them; the error of the thermistor when it reads none.
    [[nodiscard]] Result<Celsius> temperature(int channel) {
        return device::Thermistor{}.celsius(device::ads7828::fraction(convert(channel)));
    }
    void heat(int heater, double duty) {
        printer_.pwm_written(
            now, PinId{printer_.machine().heaters[static_cast<std::size_t>(heater)].heater_pin}, duty);
    }

  private:
    Printer& printer_;
    std::array<int, kAxisCount> direction_{};
};

}  // namespace qduino::twin::testing
