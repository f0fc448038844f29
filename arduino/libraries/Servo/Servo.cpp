#include "arduino/libraries/Servo/Servo.h"

#include <algorithm>
#include <chrono>

#include "arduino/core/diagnostics.h"
#include "arduino/core/numbers.h"
#include "board/board.h"

namespace board = qduino::board;

std::uint8_t Servo::attach(int pin, int minimum_us, int maximum_us) {
    if (pin < 0 || pin >= qduino::board::kPinCount || minimum_us >= maximum_us) {
        qduino::arduino::refuse("Servo.attach", pin, qduino::ErrorCode::invalid_argument,
                                "a servo has a pin below 128 and a minimum below its maximum");
        return INVALID_SERVO;
    }
    const board::PinId id{static_cast<std::uint16_t>(pin)};
    if (!qduino::arduino::succeeded(
            "Servo.attach", pin,
            board::current().pwm_period(id, std::chrono::microseconds{REFRESH_INTERVAL})))
        return INVALID_SERVO;
    pin_ = pin;
    minimum_us_ = minimum_us;
    maximum_us_ = maximum_us;
    writeMicroseconds(width_us_);
    return static_cast<std::uint8_t>(pin);
}

void Servo::detach() {
    if (!attached()) return;
    const board::PinId pin{static_cast<std::uint16_t>(pin_)};
    qduino::arduino::succeeded("Servo.detach", pin_, board::current().pwm_write(pin, 0.0));
    qduino::arduino::succeeded("Servo.detach", pin_,
                               board::current().pwm_period(pin, qduino::Nanoseconds{0}));
    pin_ = -1;
}

void Servo::write(int value) {
    if (value < MIN_PULSE_WIDTH) {
        value = static_cast<int>(map(constrain(value, 0, 180), 0, 180, minimum_us_, maximum_us_));
    }
    writeMicroseconds(value);
}

void Servo::writeMicroseconds(int width_us) {
    width_us_ = std::clamp(width_us, minimum_us_, maximum_us_);
    if (attached()) put_out();
}

int Servo::read() const {
    // The middle of the step that map() rounds down into, so that read() returns what was written.
    return static_cast<int>(map(width_us_ + 1, minimum_us_, maximum_us_, 0, 180));
}

void Servo::put_out() {
    const board::PinId pin{static_cast<std::uint16_t>(pin_)};
    const double duty = static_cast<double>(width_us_) / REFRESH_INTERVAL;
    qduino::arduino::succeeded("Servo.write", pin_, board::current().pwm_write(pin, duty));
}
