// What is wired to the printer's pins in Bochs, where no program outside can play it: switches that
// close, and a nozzle that is hot already.
//
//   STEP, DIR ─► position of each slide ─► its switch         a few instructions a step
//   every write ─► the port of the pins ─► the emulator's log: the witness
//   E's STEP ─► filament melted ─┐
//   heaters and fan ─► PWM ──────┴► blocks and sensors of the twin ─► the converter's chip ─► I2C
//
// A sensor that told the same temperature for ever would be a fault, and rightly (heat_balance.h).
// So the nozzle obeys the twin's physics, and has been heated before the machine began.
//
// The slides stand where those of the twin do (twin/machine.h), so the same file takes the same
// steps here as in the simulator, homing too. Steps and switches are core 1's alone, heat and the
// converter are loop 3's. What is melted crosses from the one to the other as a count.
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>

#include "board/metal/computer/instructions.h"
#include "board/metal/pins.h"
#include "board/peripherals.h"
#include "device/ads7828_chip.h"
#include "twin/heater.h"
#include "twin/machine.h"

namespace qduino::witnessed_printer {
namespace {

using board::Level;
using board::PinId;

constexpr Nanoseconds kHeatedBefore = 137s;  // at full power: 210 °C

class HotPlant final : public board::Peripherals {
  public:
    HotPlant() {
        for (std::size_t axis = 0; axis < twin::kAxisCount; ++axis) {
            const twin::AxisSpec& spec = machine_.axes[axis];
            wires_[spec.step_pin] = {.role = Role::step, .axis = axis, .direction_pin = spec.direction_pin};
            if (axis >= twin::kSlideCount) continue;
            wires_[spec.endstop_pin] = {.role = Role::endstop, .axis = axis};
            position_[axis] = std::llround(spec.start_mm * spec.steps_per_mm);
        }
        for (const twin::HeaterSpec& heater : machine_.heaters)
            wires_[heater.heater_pin] = {.role = Role::heat};
        wires_[machine_.fan_pin] = {.role = Role::heat};
        nozzle().set_duty(Instant{}, 1);
        nozzle().set_duty(heat_time(Instant{}), 0);
        board::metal::pins.wire_to(*this);
    }

    // Within the time of a step, so it looks up once what a pin is.
    void pin_written(Instant now, PinId pin, Level level) override {
        board::metal::write_virtual_pin(static_cast<std::uint8_t>(pin.number), level == Level::high);
        Wire& wire = wires_[pin.number];
        const bool rises = level == Level::high && !wire.high;
        wire.high = level == Level::high;
        if (wire.role == Role::heat) return pwm_written(now, pin, wire.high ? 1 : 0);
        if (!rises || wire.role != Role::step) return;
        std::int64_t& position = position_[wire.axis];
        position += wires_[wire.direction_pin].high ? 1 : -1;
        // What was drawn back is molten already.
        if (wire.axis == twin::kExtruder && position > farthest_extruded_.load(std::memory_order_relaxed))
            farthest_extruded_.store(position, std::memory_order_relaxed);
    }
    void pwm_written(Instant now, PinId pin, double duty) override {
        for (std::size_t heater = 0; heater < twin::kHeaterCount; ++heater) {
            if (pin.number == machine_.heaters[heater].heater_pin)
                heaters_[heater].set_duty(heat_time(now), duty);
            if (pin.number == machine_.fan_pin) heaters_[heater].set_fan(heat_time(now), duty);
        }
    }
    Level pin_level(Instant, PinId pin) override {
        const Wire& wire = wires_[pin.number];
        return wire.role == Role::endstop && position_[wire.axis] <= 0 ? Level::high : Level::low;
    }
    double analog_level(Instant, PinId) override { return 0; }
    Result<void> i2c_transfer(Instant now, board::I2cBus, board::I2cAddress,
                              std::span<const std::uint8_t> out, std::span<std::uint8_t> in) override {
        for (twin::Heater& heater : heaters_) heater.advance(heat_time(now));
        const std::int64_t extruded = farthest_extruded_.load(std::memory_order_relaxed);
        nozzle().melt(static_cast<double>(extruded - melted_) * machine_.step_volume_mm3());
        melted_ = extruded;
        converter_.transfer(out, in, [this](int channel) {
            const std::size_t heater =
                channel == machine_.heaters[twin::kHotEnd].adc_channel ? twin::kHotEnd : twin::kBed;
            return machine_.adc_reference_v *
                   machine_.heaters[heater].sensor.fraction(Celsius{heaters_[heater].sensor_celsius()});
        });
        return {};
    }
    Result<void> spi_transfer(Instant, board::SpiBus, board::SpiSettings, std::span<std::uint8_t>) override {
        return {};
    }

  private:
    enum class Role : std::uint8_t { none, step, endstop, heat };
    struct Wire {
        Role role = Role::none;
        bool high = false;
        std::size_t axis = 0;
        std::uint16_t direction_pin = 0;  // of a step pin
    };

    static Instant heat_time(Instant now) { return now + kHeatedBefore; }
    twin::Heater& nozzle() { return heaters_[twin::kHotEnd]; }

    twin::Machine machine_;
    std::array<twin::Heater, twin::kHeaterCount> heaters_{
        {{machine_.heaters[0], machine_.ambient_celsius}, {machine_.heaters[1], machine_.ambient_celsius}}};
    std::array<Wire, board::kPinCount> wires_{};
    std::array<std::int64_t, twin::kAxisCount> position_{};
    std::atomic<std::int64_t> farthest_extruded_{0};  // written by core 1
    std::int64_t melted_ = 0;                         // loop 3's
    device::Ads7828Chip converter_{machine_.adc_reference_v};
} plant;

}  // namespace
}  // namespace qduino::witnessed_printer
