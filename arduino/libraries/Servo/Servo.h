// Servo: a hobby servo on a PWM pin.
//
//   ▔▔▁▁▁▁▁▁▁▁▁▁▁▁▁▁▁▁▁▁▔▔▁▁▁     one pulse of 544–2400 µs in every 20 ms; its width is the angle
//   ◄──────── 20 ms ────►
//
// The board's PWM makes the pulse: attach() sets this pin to 50 Hz, and detach() sets it back. The
// duty is width / 20 ms. So there is no software jitter, and no loop is needed.
#pragma once

#include <cstdint>

inline constexpr int MIN_PULSE_WIDTH = 544;       // µs, at 0°
inline constexpr int MAX_PULSE_WIDTH = 2400;      // µs, at 180°
inline constexpr int DEFAULT_PULSE_WIDTH = 1500;  // µs, when attached
inline constexpr int REFRESH_INTERVAL = 20000;    // µs
inline constexpr std::uint8_t INVALID_SERVO = 255;

class Servo {
  public:
    /// Setup-time. Begins with the width last written, or 1500 µs. Returns the pin, or
    /// INVALID_SERVO.
    std::uint8_t attach(int pin, int minimum_us = MIN_PULSE_WIDTH, int maximum_us = MAX_PULSE_WIDTH);
    void detach();
    [[nodiscard]] bool attached() const { return pin_ >= 0; }

    /// An angle of 0–180°; from MIN_PULSE_WIDTH on it is taken for a width in µs.
    void write(int value);
    /// Clamped to the limits given to attach().
    void writeMicroseconds(int width_us);
    /// The last angle written.
    [[nodiscard]] int read() const;
    [[nodiscard]] int readMicroseconds() const { return width_us_; }

  private:
    void put_out();

    int pin_ = -1;
    int minimum_us_ = MIN_PULSE_WIDTH;
    int maximum_us_ = MAX_PULSE_WIDTH;
    int width_us_ = DEFAULT_PULSE_WIDTH;
};
