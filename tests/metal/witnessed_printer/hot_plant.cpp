// What is wired to the printer's pins in Bochs, where no program outside can play it: switches that
// close, and a nozzle that is hot already.
//
//   STEP, DIR ─► position of each slide ─► its switch         a few instructions a step
//   every write ─► the port of the pins ─► the emulator's log: the witness
//   I2C ─► the converter's chip ─► 205 °C at the nozzle, 20 °C at the bed, whatever the heaters do
//
// The slides stand where those of the twin do (twin/machine.h), so the same file takes the same
// steps here as in the simulator, homing too. Steps and switches are core 1's alone, the converter
// is loop 3's.
#include <array>
#include <cmath>
#include <cstdint>

#include "board/metal/machine/instructions.h"
#include "board/metal/pins.h"
#include "board/peripherals.h"
#include "device/ads7828_chip.h"
#include "twin/machine.h"

namespace qduino::witnessed_printer {
namespace {

using board::Level;
using board::PinId;

class HotPlant final : public board::Peripherals {
  public:
    HotPlant() {
        for (std::size_t slide = 0; slide < twin::kSlideCount; ++slide) {
            const twin::AxisSpec& axis = machine_.axes[slide];
            position_[slide] = std::llround(axis.start_mm * axis.steps_per_mm);
            slide_of_[axis.step_pin] = slide_of_[axis.endstop_pin] = static_cast<std::int8_t>(slide);
        }
        board::metal::pins.wire_to(*this);
    }

    void pin_written(Instant, PinId pin, Level level) override {
        board::metal::write_virtual_pin(static_cast<std::uint8_t>(pin.number), level == Level::high);
        const bool rises = level == Level::high && !high_[pin.number];
        high_[pin.number] = level == Level::high;
        if (!rises || slide_of_[pin.number] < 0) return;
        const auto slide = static_cast<std::size_t>(slide_of_[pin.number]);
        position_[slide] += high_[machine_.axes[slide].direction_pin] ? 1 : -1;
    }
    void pwm_written(Instant, PinId, double) override {}
    Level pin_level(Instant, PinId pin) override {
        const int slide = slide_of_[pin.number];
        return slide >= 0 && position_[static_cast<std::size_t>(slide)] <= 0 ? Level::high : Level::low;
    }
    double analog_level(Instant, PinId) override { return 0; }
    Result<void> i2c_transfer(Instant, board::I2cBus, board::I2cAddress, std::span<const std::uint8_t> out,
                              std::span<std::uint8_t> in) override {
        converter_.transfer(out, in, [this](int channel) {
            const bool nozzle = channel == machine_.heaters[twin::kHotEnd].adc_channel;
            const auto& sensor = machine_.heaters[nozzle ? twin::kHotEnd : twin::kBed].sensor;
            return machine_.adc_reference_v * sensor.fraction(nozzle ? 205_celsius : 20_celsius);
        });
        return {};
    }
    Result<void> spi_transfer(Instant, board::SpiBus, board::SpiSettings, std::span<std::uint8_t>) override {
        return {};
    }

  private:
    twin::Machine machine_;
    std::array<std::int8_t, board::kPinCount> slide_of_ = [] {
        std::array<std::int8_t, board::kPinCount> none{};
        none.fill(-1);
        return none;
    }();
    std::array<bool, board::kPinCount> high_{};
    std::array<std::int64_t, twin::kSlideCount> position_{};
    device::Ads7828Chip converter_{machine_.adc_reference_v};
} plant;

}  // namespace
}  // namespace qduino::witnessed_printer
