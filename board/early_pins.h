// Pins before there is a board.
//
// A library's object at global scope is made before main(). Its constructor may make a pin an
// output (AccelStepper, Stepper). On an Arduino that works, for the pin is a register. Here there
// is no board yet: the call would be lost, and the motor would never move. So the last mode, level
// and PWM of each pin are remembered, and done on the board before setup().
//
//   constructor ──► pinMode(9, OUTPUT) ──► EarlyPins ──► hand_over() ──► board ──► setup()
//
// A pulse is not repeated: only what holds in the end.
#pragma once

#include <array>
#include <optional>

#include "board/board.h"

namespace qduino::board {

class EarlyPins {
  public:
    /// Each: invalid_argument when there is no such pin.
    Result<void> mode(PinId pin, PinMode mode);
    Result<void> pwm(PinId pin, double duty);
    void write(PinId pin, Level level);
    /// What an output was set to last; of an input: high with a pull-up, else low.
    [[nodiscard]] Level read(PinId pin) const;
    /// Does all this on `board`, and forgets it. A pin that cannot be had is told to `refused`.
    void hand_over(Board& board, PinRefused refused);

  private:
    struct Pin {
        std::optional<PinMode> mode;
        std::optional<Level> level;
        std::optional<double> duty;
    };
    std::array<Pin, kPinCount> pins_{};
};

}  // namespace qduino::board
