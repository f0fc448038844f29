// The waveform of LEDs with one wire (WS2812 and the like): each bit begins with a rise, and the
// length of its high level says which it is.
//
//   any pin   the calling loop makes each edge at its instant. A loop that shares its core may be
//             interrupted, and the strip then shows something else: let one that owns its core send
//   pin 51    (MOSI) the strip is on SPI, which keeps the time by itself: three bits for one. The
//             way for a Linux board, whose pins take a system call each
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/time.h"

namespace qduino::arduino {

/// How long a bit is, its high level for 0 and for 1, and the rest after which the strip shows.
struct PixelTiming {
    Nanoseconds bit, zero, one, latch;
};

// Worldsemi's data sheets of WS2812B and WS2811 (half the speed); newer strips want 280 µs to show.
inline constexpr Nanoseconds kPixelLatch{300'000};
inline constexpr PixelTiming kWs2812{Nanoseconds{1250}, Nanoseconds{400}, Nanoseconds{800}, kPixelLatch};
inline constexpr PixelTiming kWs2811Slow{Nanoseconds{2500}, Nanoseconds{800}, Nanoseconds{1600}, kPixelLatch};

class PixelWave {
  public:
    /// Setup-time: room for so many bytes, which are 0.
    void resize(std::size_t bytes);
    /// Setup-time: the pin is ready to send.
    static void begin(int pin);
    /// What is sent next.
    [[nodiscard]] std::span<std::uint8_t> bytes() { return bytes_; }
    /// True when the strip shows what was sent last.
    [[nodiscard]] bool shown() const;
    /// Sends the bytes, after a wait until the last ones are shown. Nothing where the pin is below
    /// 0.
    void send(int pin, const PixelTiming& timing, const char* call);

  private:
    void by_pin(int pin, const PixelTiming& timing);
    void by_spi(const PixelTiming& timing, const char* call);

    std::vector<std::uint8_t> bytes_;
    std::vector<std::uint8_t> wave_;  // on SPI: three bits for each of these
    Instant ready_{};                 // when the strip shows the last ones
};

}  // namespace qduino::arduino
