#include "board/metal/driver/lpt_port.h"

namespace qduino::board::metal {
namespace {

constexpr std::uint8_t kData = 0, kStatus = 1, kControl = 2;

}  // namespace

std::optional<LptPort::Place> LptPort::place_of(PinId pin) {
    const auto data_bit = static_cast<std::uint8_t>(pin.number - 2);
    switch (pin.number) {
        case 1:
            return Place{kControl, 0, true};
        case 10:
            return Place{kStatus, 6, false};
        case 11:
            return Place{kStatus, 7, true};
        case 12:
            return Place{kStatus, 5, false};
        case 13:
            return Place{kStatus, 4, false};
        case 14:
            return Place{kControl, 1, true};
        case 15:
            return Place{kStatus, 3, false};
        case 16:
            return Place{kControl, 2, false};
        case 17:
            return Place{kControl, 3, true};
        default:
            if (pin.number >= 2 && pin.number <= 9) return Place{kData, data_bit, false};
            return std::nullopt;
    }
}

bool LptPort::is_output_of_port(const Place& place) { return place.offset != kStatus; }

bool LptPort::open() {
    // Bits 4 and 5 of the control register stay 0: no interrupt, and the data lines are outputs.
    constexpr std::uint8_t kAllLow = 0b1011;
    data_ = 0;
    control_ = kAllLow;
    ports_.write(base_ + kData, data_);
    ports_.write(base_ + kControl, control_);
    return ports_.read(base_ + kData) == data_;  // 0xff where there is no device
}

Result<void> LptPort::set_mode(PinId pin, PinMode mode, Level level) {
    const std::optional<Place> place = place_of(pin);
    if (!place)
        return make_error(ErrorCode::not_found, "pin ", pin.number, ": a parallel port has pins 1 to 17");
    const bool output = is_output_of_port(*place);
    if (output != is_output(mode))
        return make_error(ErrorCode::unsupported, "pin ", pin.number, " of a parallel port is an ",
                          output ? "output" : "input");
    if (mode == PinMode::output_open_drain || mode == PinMode::input_pulldown)
        return make_error(ErrorCode::unsupported, "pin ", pin.number,
                          ": a parallel port has no open drain and no pull-downs");
    if (output) write(pin, level);
    return {};
}

void LptPort::write(PinId pin, Level level) {
    const std::optional<Place> place = place_of(pin);
    if (!place || !is_output_of_port(*place)) return;
    const auto mask = static_cast<std::uint8_t>(1u << place->bit);
    const bool one = (level == Level::high) != place->inverted;
    const PortGuard held(lock_);
    std::uint8_t& kept = place->offset == kData ? data_ : control_;
    kept = static_cast<std::uint8_t>(one ? kept | mask : kept & ~mask);
    ports_.write(base_ + place->offset, kept);
}

Level LptPort::read(PinId pin) {
    const std::optional<Place> place = place_of(pin);
    if (!place) return Level::low;
    const bool one = (ports_.read(base_ + place->offset) >> place->bit & 1) != 0;
    return one != place->inverted ? Level::high : Level::low;
}

}  // namespace qduino::board::metal
