#include "apps/qduino/beside_command.h"

#include <string_view>

#include "apps/beside/beside_run.h"
#include "apps/qduino/metal_command.h"
#include "apps/qduino/pin_record.h"
#include "apps/terminal/message.h"
#include "posix/small_file.h"

namespace qduino::apps {
namespace {

namespace fs = std::filesystem;

/// The pins of a run beside Linux, where no other program plays what is wired to them.
class CountedPins final : public board::Peripherals {
  public:
    void pin_written(Instant, board::PinId pin, board::Level level) override {
        tally_.note(pin.number, level == board::Level::high);
    }
    void pwm_written(Instant, board::PinId, double) override {}
    board::Level pin_level(Instant now, board::PinId pin) override { return none_.pin_level(now, pin); }
    double analog_level(Instant now, board::PinId pin) override { return none_.analog_level(now, pin); }
    Result<void> i2c_transfer(Instant now, board::I2cBus bus, board::I2cAddress address,
                              std::span<const std::uint8_t> out, std::span<std::uint8_t> in) override {
        return none_.i2c_transfer(now, bus, address, out, in);
    }
    Result<void> spi_transfer(Instant now, board::SpiBus bus, board::SpiSettings settings,
                              std::span<std::uint8_t> data) override {
        return none_.spi_transfer(now, bus, settings, data);
    }
    [[nodiscard]] std::string table() const { return tally_.table(); }

  private:
    board::NoPeripherals none_;
    PinTally tally_;
};

}  // namespace

Result<int> run_beside_linux(const Arguments& arguments, const fs::path& image, const std::string& name) {
    QDUINO_TRY_ASSIGN(const std::string bytes, posix::read_small_file(image));
    CountedPins pins;
    const beside_linux::BesideOptions options{.core = arguments.core.value_or(1),
                                              .silence = from_seconds(arguments.silence_ms / 1000),
                                              .words = image_words(arguments)};
    QDUINO_TRY_ASSIGN(
        const int status,
        beside_linux::run_beside({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}, options,
                                 pins));
    say(pins.table());
    say(verdict(status == 0   ? name + " ran to its end, and Linux has its core back."
                : status == 2 ? name + " is REFUSED: no loop of it ran. Linux has its core back."
                : status == 3 ? name + " was ENDED, for Linux was silent. It has its core back."
                              : name + " FAILED. Linux has its core back."));
    return status == 3 ? 1 : status;
}

}  // namespace qduino::apps
