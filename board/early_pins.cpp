#include "board/early_pins.h"

#include <utility>

namespace qduino::board {
namespace {

Error no_such_pin() { return make_error(ErrorCode::invalid_argument, "no such pin: the board has 0 to 127"); }

}  // namespace

Result<void> EarlyPins::mode(PinId pin, PinMode mode) {
    if (pin.number >= kPinCount) return no_such_pin();
    pins_[pin.number].mode = mode;
    return {};
}

Result<void> EarlyPins::pwm(PinId pin, double duty) {
    if (pin.number >= kPinCount) return no_such_pin();
    pins_[pin.number].duty = duty;
    return {};
}

void EarlyPins::write(PinId pin, Level level) {
    if (pin.number >= kPinCount) return;
    pins_[pin.number].level = level;
    pins_[pin.number].duty.reset();
}

Level EarlyPins::read(PinId pin) const {
    if (pin.number >= kPinCount) return Level::low;
    const Pin& state = pins_[pin.number];
    if (state.mode && is_output(*state.mode)) return state.level.value_or(Level::low);
    return state.mode == PinMode::input_pullup ? Level::high : Level::low;
}

void EarlyPins::hand_over(Board& board, PinRefused refused) {
    const auto pins = std::exchange(pins_, {});
    for (std::uint16_t number = 0; number < kPinCount; ++number) {
        const PinId pin{number};
        const auto& [mode, level, duty] = pins[number];
        // First: what was written shows when the pin becomes an output, without an edge in between.
        if (level) board.pin_write(pin, *level);
        if (mode) {
            if (const auto done = board.pin_mode(pin, *mode); !done.ok()) refused(pin, done.error());
        }
        if (!duty) continue;
        if (const auto done = board.pwm_write(pin, *duty); !done.ok()) refused(pin, done.error());
    }
}

}  // namespace qduino::board
