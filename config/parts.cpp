#include "config/parts.h"

#include <algorithm>
#include <utility>

#include "base/text.h"
#include "base/words.h"
#include "board/types.h"
#include "device/ds18b20_chip.h"
#include "device/hx711_chip.h"
#include "device/nec_remote.h"
#include "device/ssd1306_chip.h"
#include "device/ws2812_chip.h"
#include "posix/small_file.h"

namespace qduino::apps {
namespace {

using board::Level;
using board::PinId;

constexpr PinId kMosi{51};

/// "3c"
std::string hexadecimal(unsigned value, std::size_t digits) {
    std::string text;
    write_characters(text, value, 16);
    return std::string(text.size() < digits ? digits - text.size() : 0, '0') + text;
}

constexpr Words<device::Hx711Input::a_128, device::Hx711Input::a_64> kInputs{"A at 128", "B at 32",
                                                                             "A at 64"};

class LoadCell final : public Part {
  public:
    explicit LoadCell(const PartSpec& spec) : spec_(spec), chip_(spec.value, spec.value_b) {}
    void driven(Instant now, PinId pin, bool high) override {
        if (pin == spec_.clock) chip_.clock(now, high);
    }
    bool pulls_low(Instant now, PinId pin) override { return pin == spec_.data && !chip_.data(now); }
    std::string report() const override {
        return text<std::string>("hx711 on pins ", spec_.data.number, " and ", spec_.clock.number, ": ",
                                 chip_.results(), " results read, switched off ", chip_.power_downs(),
                                 " times; the next is of input ", kInputs(chip_.input()), "\n");
    }

  private:
    PartSpec spec_;
    device::Hx711Chip chip_;
};

class Thermometer final : public Part {
  public:
    explicit Thermometer(const PartSpec& spec) : pin_(spec.data), chip_(spec.serial, spec.celsius) {}
    void driven(Instant now, PinId, bool high) override { chip_.master(now, high); }
    bool pulls_low(Instant now, PinId) override { return chip_.pulls(now); }
    std::string report() const override {
        std::string line = "ds18b20 ";
        for (const std::uint8_t byte : chip_.rom()) line += hexadecimal(byte, 2);
        write(line, " on pin ", pin_.number, ": ", chip_.conversions(), " conversions");
        if (chip_.unclear_slots() > 0)
            write(line, ", ", chip_.unclear_slots(), " slots of a length that is neither a 0 nor a 1");
        return line + "\n";
    }

  private:
    PinId pin_;
    device::Ds18b20Chip chip_;
};

class Display final : public Part {
  public:
    explicit Display(const PartSpec& spec) : spec_(spec), chip_(spec.height) {}
    bool transferred(board::I2cBus bus, board::I2cAddress address, std::span<const std::uint8_t> out,
                     std::span<std::uint8_t> in) override {
        if (bus.number != spec_.bus.number || address.value != spec_.address.value) return false;
        chip_.transfer(out, in);
        return true;
    }
    std::string report() const override {
        int lit = 0;
        for_each_dot([&](bool shines, bool) { lit += shines ? 1 : 0; });
        std::string line = "ssd1306 at 0x" + hexadecimal(spec_.address.value, 2);
        write(line, " of I2C ", spec_.bus.number, ": ", lit, " of ",
              device::Ssd1306Chip::kWidth * chip_.height(), " dots shine, ", chip_.data_bytes(),
              " bytes of data");
        if (chip_.unknown_commands() > 0)
            write(line, ", ", chip_.unknown_commands(), " commands that it does not know");
        if (!chip_.is_on()) line += ", switched off";
        if (!spec_.picture.empty()) write(line, "; picture: ", spec_.picture);
        return line + "\n";
    }
    /// Netpbm's plain bitmap: 1 is a dot that shines.
    Result<void> finish() const override {
        if (spec_.picture.empty()) return {};
        auto bitmap = text<std::string>("P1\n", device::Ssd1306Chip::kWidth, " ", chip_.height(), "\n");
        for_each_dot([&](bool shines, bool is_last) {
            bitmap += shines ? '1' : '0';
            if (is_last) bitmap += '\n';
        });
        return posix::write_file(spec_.picture, bitmap);
    }

  private:
    /// `visit(shines, is the last of its row)`
    template <typename Visit>
    void for_each_dot(Visit visit) const {
        for (int y = 0; y < chip_.height(); ++y) {
            for (int x = 0; x < device::Ssd1306Chip::kWidth; ++x)
                visit(chip_.lit(x, y), x + 1 == device::Ssd1306Chip::kWidth);
        }
    }

    PartSpec spec_;
    device::Ssd1306Chip chip_;
};

class Strip final : public Part {
  public:
    explicit Strip(const PartSpec& spec) : pin_(spec.data), chip_(static_cast<std::size_t>(spec.pixels)) {}
    void driven(Instant now, PinId, bool high) override { chip_.data(now, high); }
    void settle(Instant now) override { chip_.settle(now); }
    std::string report() const override {
        constexpr std::size_t kNamed = 16;
        std::string line = "ws2812 on pin ";
        write(line, pin_.number, ": ", chip_.frames(), " frames; shows");
        for (std::size_t i = 0; i < std::min(kNamed, chip_.shown().size()); ++i)
            line += " " + hexadecimal(chip_.shown()[i], 6);
        if (chip_.shown().size() > kNamed) line += " …";
        if (chip_.unclear() > 0) write(line, "; ", chip_.unclear(), " pulses that are neither a 0 nor a 1");
        return line + "\n";
    }

  private:
    PinId pin_;
    device::Ws2812Chip chip_;
};

/// A receiver module for infrared light: its output is low while there is light.
class InfraredReceiver final : public Part {
  public:
    explicit InfraredReceiver(const PartSpec& spec)
        : spec_(spec),
          remote_(spec.light.at, static_cast<std::uint8_t>(spec.light.remote),
                  static_cast<std::uint8_t>(spec.light.command), spec.light.repeats) {}
    void dimmed(Instant, PinId pin, double duty) override {
        const bool shines = duty > 0;
        if (pin != spec_.light.led || shines == led_shines_) return;
        led_shines_ = shines;
        if (shines) ++flashes_;
    }
    bool pulls_low(Instant now, PinId pin) override {
        return pin == spec_.data && (led_shines_ || remote_.light(now));
    }
    std::string report() const override {
        auto line = text<std::string>("ir on pin ", spec_.data.number);
        if (spec_.light.led.number < board::kPinCount)
            write(line, ": ", flashes_, " flashes of the LED on pin ", spec_.light.led.number);
        return line + "\n";
    }

  private:
    PartSpec spec_;
    device::NecRemote remote_;
    bool led_shines_ = false;
    std::uint64_t flashes_ = 0;
};

}  // namespace

Parts::Parts(const std::vector<PartSpec>& list) {
    for (const PartSpec& spec : list) {
        switch (spec.chip) {
            case Chip::hx711:
                parts_.push_back(std::make_unique<LoadCell>(spec));
                wire(spec.data, *parts_.back());
                wire(spec.clock, *parts_.back());
                break;
            case Chip::ds18b20:
                parts_.push_back(std::make_unique<Thermometer>(spec));
                wire(spec.data, *parts_.back());
                break;
            case Chip::ssd1306:
                parts_.push_back(std::make_unique<Display>(spec));
                break;
            case Chip::ws2812:
                parts_.push_back(std::make_unique<Strip>(spec));
                wire(spec.data, *parts_.back());
                break;
            case Chip::ir:
                parts_.push_back(std::make_unique<InfraredReceiver>(spec));
                wire(spec.data, *parts_.back());
                if (spec.light.led.number < board::kPinCount) wire(spec.light.led, *parts_.back());
                break;
        }
    }
}

void Parts::pin_written(Instant now, PinId pin, Level level) {
    for (Part* part : on_pin_[pin.number]) part->driven(now, pin, level == Level::high);
}

void Parts::pin_released(Instant now, PinId pin) {
    for (Part* part : on_pin_[pin.number]) part->driven(now, pin, true);
}

void Parts::pwm_written(Instant now, PinId pin, double duty) {
    for (Part* part : on_pin_[pin.number]) part->dimmed(now, pin, duty);
}

Level Parts::pin_level(Instant now, PinId pin) {
    bool high = !on_pin_[pin.number].empty() || pulled_up_.test(pin.number);
    for (Part* part : on_pin_[pin.number]) high = high && !part->pulls_low(now, pin);
    return high ? Level::high : Level::low;
}

Result<void> Parts::i2c_transfer(Instant now, board::I2cBus bus, board::I2cAddress address,
                                 std::span<const std::uint8_t> out, std::span<std::uint8_t> in) {
    for (const auto& part : parts_) {
        if (part->transferred(bus, address, out, in)) return {};
    }
    return board::NoPeripherals().i2c_transfer(now, bus, address, out, in);
}

Result<void> Parts::spi_transfer(Instant now, board::SpiBus bus, board::SpiSettings settings,
                                 std::span<std::uint8_t> data) {
    const auto& wired = on_pin_[kMosi.number];
    if (bus.number != 0 || wired.empty() || settings.clock_hz == 0) return {};
    std::int64_t bit = 0;
    const auto drive = [&](bool high) {
        const Instant at = now + Nanoseconds{bit++ * 1'000'000'000 / settings.clock_hz};
        for (Part* part : wired) part->driven(at, kMosi, high);
    };
    for (const std::uint8_t byte : data) {
        for (int i = 0; i < 8; ++i) drive((byte >> (settings.least_significant_first ? i : 7 - i) & 1) != 0);
    }
    drive(false);
    return {};
}

std::string Parts::report(Instant now) const {
    std::string lines;
    for (const auto& part : parts_) {
        part->settle(now);
        lines += part->report();
    }
    return lines;
}

Result<void> Parts::finish() const {
    for (const auto& part : parts_) QDUINO_TRY(part->finish());
    return {};
}

}  // namespace qduino::apps
