#include "arduino/Adafruit_NeoPixel.h"

#include <algorithm>
#include <cmath>

#include "arduino/core/diagnostics.h"
#include "board/board.h"

namespace board = qduino::board;
using qduino::Instant;
using qduino::Nanoseconds;

namespace {

// Worldsemi, WS2812B data sheet; half the speed: WS2811. Newer strips want 280 µs to show.
constexpr Nanoseconds kBit{1250}, kZero{400}, kOne{800}, kLatch{300'000};

}  // namespace

Adafruit_NeoPixel::Adafruit_NeoPixel(std::uint16_t pixels, std::int16_t pin, neoPixelType type)
    : pin_(pin), type_(type) {
    updateLength(pixels);
}

void Adafruit_NeoPixel::updateLength(std::uint16_t pixels) {
    colors_.assign(pixels, 0);
    const bool has_white = (type_ >> 6 & 3) != (type_ >> 4 & 3);
    bytes_.assign(pixels * (has_white ? std::size_t{4} : std::size_t{3}), 0);
    wave_.assign(3 * bytes_.size() + 1, 0);
}

void Adafruit_NeoPixel::updateType(neoPixelType type) {
    type_ = type;
    updateLength(numPixels());
}

void Adafruit_NeoPixel::begin() { setPin(pin_); }

void Adafruit_NeoPixel::setPin(std::int16_t pin) {
    pin_ = pin;
    if (pin_ < 0 || pin_ == MOSI) return;
    pinMode(pin_, OUTPUT);
    digitalWrite(pin_, LOW);
}

bool Adafruit_NeoPixel::canShow() const { return board::current().now() >= ready_; }

void Adafruit_NeoPixel::show() {
    if (pin_ < 0 || colors_.empty()) return;
    encode();
    qduino::arduino::wait_until(ready_);
    // A bus may return before it has sent everything.
    const Instant sent = board::current().now() + bit_length() * static_cast<std::int64_t>(8 * bytes_.size());
    pin_ == MOSI ? send_by_spi() : send_by_pin();
    ready_ = std::max(board::current().now(), sent) + kLatch;
}

Nanoseconds Adafruit_NeoPixel::bit_length() const { return (type_ & NEO_KHZ400) != 0 ? 2 * kBit : kBit; }

void Adafruit_NeoPixel::encode() {
    const auto place = [this](int shift) { return std::size_t{type_} >> shift & 3; };
    const std::size_t size = bytes_.size() / colors_.size();
    for (std::size_t i = 0; i < colors_.size(); ++i) {
        const auto level = [&](int shift) {
            return static_cast<std::uint8_t>((colors_[i] >> shift & 0xFF) * (brightness_ + 1u) >> 8);
        };
        std::uint8_t* const pixel = &bytes_[i * size];
        if (size == 4) pixel[place(6)] = level(24);
        pixel[place(4)] = level(16);
        pixel[place(2)] = level(8);
        pixel[place(0)] = level(0);
    }
}

void Adafruit_NeoPixel::send_by_pin() {
    board::Board& board = board::current();
    const board::PinId pin{static_cast<std::uint16_t>(pin_)};
    const std::int64_t slower = bit_length() / kBit;
    Instant edge = board.now() + kBit;
    for (const std::uint8_t sent : bytes_) {
        for (unsigned mask = 0x80; mask != 0; mask >>= 1) {
            board.busy_until(edge);
            board.pin_write(pin, board::Level::high);
            board.busy_until(edge + slower * ((sent & mask) != 0 ? kOne : kZero));
            board.pin_write(pin, board::Level::low);
            edge += slower * kBit;
        }
    }
}

void Adafruit_NeoPixel::send_by_spi() {
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
    const auto clock_hz = static_cast<std::uint32_t>(3'000'000'000 / bit_length().count());
    const auto done = board::current().spi_transfer(board::SpiBus{0}, {.clock_hz = clock_hz}, wave_);
    qduino::arduino::succeeded("NeoPixel.show", pin_, done);
}

void Adafruit_NeoPixel::setPixelColor(std::uint16_t index, std::uint32_t color) {
    if (index < colors_.size()) colors_[index] = color;
}

void Adafruit_NeoPixel::fill(std::uint32_t color, std::uint16_t first, std::uint16_t count) {
    const std::size_t from = std::min<std::size_t>(first, colors_.size());
    const std::size_t most = colors_.size() - from;
    std::fill_n(colors_.begin() + static_cast<std::ptrdiff_t>(from),
                count == 0 ? most : std::min<std::size_t>(count, most), color);
}

std::uint32_t Adafruit_NeoPixel::getPixelColor(std::uint16_t index) const {
    return index < colors_.size() ? colors_[index] : 0;
}

std::uint32_t Adafruit_NeoPixel::ColorHSV(std::uint16_t hue, std::uint8_t saturation, std::uint8_t value) {
    // Each colour is whole for a third of the circle, and rises and falls in a sixth.
    const auto level = [&](int shift) {
        const int at = (hue + shift) % 65536 * 6;           // 0 … 393210: six sixths of 65536
        const int away = std::abs(at - 3 * 65536) - 65536;  // < 0: dark; > 65536: whole
        const int pure = std::clamp(away, 0, 65536) * 255 / 65536;
        return static_cast<std::uint8_t>((255 * 255 - (255 - pure) * saturation) / 255 * value / 255);
    };
    return Color(level(0), level(2 * 65536 / 3), level(65536 / 3));
}

std::uint8_t Adafruit_NeoPixel::gamma8(std::uint8_t level) {
    return static_cast<std::uint8_t>(std::pow(level / 255.0, 2.6) * 255 + 0.5);
}

std::uint32_t Adafruit_NeoPixel::gamma32(std::uint32_t color) {
    std::uint32_t corrected = 0;
    for (int shift = 0; shift < 32; shift += 8)
        corrected |= std::uint32_t{gamma8(static_cast<std::uint8_t>(color >> shift))} << shift;
    return corrected;
}
