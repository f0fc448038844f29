#include "arduino/libraries/NeoPixel/pixel_wave.h"

#include <algorithm>

#include "arduino/core/board_pins.h"
#include "arduino/core/constants.h"
#include "arduino/core/diagnostics.h"
#include "arduino/core/timing.h"
#include "arduino/core/wiring.h"

namespace qduino::arduino {

void PixelWave::resize(std::size_t bytes) {
    bytes_.assign(bytes, 0);
    wave_.assign(3 * bytes + 1, 0);
}

void PixelWave::begin(int pin) {
    if (pin < 0 || pin == PIN_SPI_MOSI) return;
    pinMode(pin, OUTPUT);
    digitalWrite(pin, LOW);
}

bool PixelWave::shown() const { return board::current().now() >= ready_; }

void PixelWave::send(int pin, const PixelTiming& timing, const char* call) {
    if (pin < 0 || bytes_.empty()) return;
    wait_until(ready_);
    // A bus may return before it has sent everything.
    const Instant sent = board::current().now() + timing.bit * static_cast<std::int64_t>(8 * bytes_.size());
    pin == PIN_SPI_MOSI ? by_spi(timing, call) : by_pin(pin, timing);
    ready_ = std::max(board::current().now(), sent) + timing.latch;
}

void PixelWave::by_pin(int pin, const PixelTiming& timing) {
    board::Board& board = board::current();
    const board::PinId id{static_cast<std::uint16_t>(pin)};
    Instant edge = board.now() + kWs2812.bit;
    for (const std::uint8_t sent : bytes_) {
        for (unsigned mask = 0x80; mask != 0; mask >>= 1) {
            board.busy_until(edge);
            board.pin_write(id, board::Level::high);
            board.busy_until(edge + ((sent & mask) != 0 ? timing.one : timing.zero));
            board.pin_write(id, board::Level::low);
            edge += timing.bit;
        }
    }
}

void PixelWave::by_spi(const PixelTiming& timing, const char* call) {
    std::ranges::fill(wave_, std::uint8_t{0});
    std::size_t at = 0;
    for (const std::uint8_t sent : bytes_) {
        for (unsigned mask = 0x80; mask != 0; mask >>= 1) {
            for (const bool high : {true, (sent & mask) != 0, false}) {
                if (high) wave_[at / 8] = static_cast<std::uint8_t>(wave_[at / 8] | 0x80 >> at % 8);
                ++at;
            }
        }
    }
    const auto clock_hz = static_cast<std::uint32_t>(3'000'000'000 / timing.bit.count());
    const auto done = board::current().spi_transfer(board::SpiBus{0}, {.clock_hz = clock_hz}, wave_);
    succeeded(call, PIN_SPI_MOSI, done);
}

}  // namespace qduino::arduino
