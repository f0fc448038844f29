#include "arduino/libraries/FastLED/fastled/controllers.h"

#include <algorithm>

#include "arduino/core/board_pins.h"
#include "arduino/core/constants.h"
#include "arduino/core/diagnostics.h"
#include "arduino/core/timing.h"
#include "arduino/core/wiring.h"
#include "board/board.h"

namespace board = qduino::board;

PixelController::PixelController(std::span<const CRGB> pixels, const CRGB& scale, EOrder order)
    : pixels_(pixels), scale_(scale), order_(order) {}

void PixelController::dither(unsigned frame) {
    // The frame's three bits in reverse, so that neighbours in time are far from each other.
    const unsigned step = (frame & 1) << 7 | (frame & 2) << 5 | (frame & 4) << 3 | 0x10;
    for (int i = 0; i < 3; ++i) {
        const std::uint8_t scale = scale_.raw[i];
        if (scale == 0 || scale == 255) continue;  // nothing is rounded
        const int lost = 256 / scale;              // levels that are one when they are scaled
        turn_.raw[i] = static_cast<std::uint8_t>(lost);
        more_.raw[i] =
            qsub8(scale8(static_cast<std::uint8_t>(step), static_cast<fract8>(std::min(lost + 1, 255))), 1);
    }
}

CRGB PixelController::next(const CRGB& pixel) {
    CRGB levels = pixel;
    levels.each_with(
        more_, [](std::uint8_t level, std::uint8_t more) { return level == 0 ? 0 : qadd8(level, more); });
    more_.each_with(turn_, [](std::uint8_t more, std::uint8_t turn) { return sub8(turn, more); });
    return levels.nscale8(scale_);
}

CLEDController* CLEDController::first_ = nullptr;

CLEDController::~CLEDController() {
    for (CLEDController** at = &first_; *at != nullptr; at = &(*at)->next_) {
        if (*at != this) continue;
        *at = next_;
        return;
    }
}

void CLEDController::enlist() {
    CLEDController** at = &first_;
    for (; *at != nullptr; at = &(*at)->next_) {
        if (*at == this) return;
    }
    *at = this;
}

CLEDController& CLEDController::setLeds(CRGB* pixels, int count) {
    pixels_ = std::span(pixels, static_cast<std::size_t>(std::max(count, 0)));
    one_color_.resize(pixels_.size());
    resize(size());
    return *this;
}

void CLEDController::showLeds(std::uint8_t brightness) { show(pixels_, brightness); }

void CLEDController::showColor(const CRGB& color, std::uint8_t brightness) {
    std::ranges::fill(one_color_, color);
    show(one_color_, brightness);
}

void CLEDController::clearLeds() {
    clearLedData();
    showLeds(0);
}

void CLEDController::clearLedData() { std::ranges::fill(pixels_, CRGB(0, 0, 0)); }

void CLEDController::show(std::span<const CRGB> pixels, std::uint8_t brightness) {
    PixelController sent(pixels, getAdjustment(brightness), order());
    if (dither_ == BINARY_DITHER) sent.dither(++frame_);
    send(sent);
}

CRGB CLEDController::getAdjustment(std::uint8_t brightness) const {
    CRGB adjustment(0, 0, 0);
    for (int i = 0; i < 3; ++i) {
        const std::uint32_t correction = correction_.raw[i], temperature = temperature_.raw[i];
        if (correction == 0 || temperature == 0 || brightness == 0) continue;
        adjustment.raw[i] =
            static_cast<std::uint8_t>((correction + 1) * (temperature + 1) * brightness / 0x10000);
    }
    return adjustment;
}

namespace qduino::arduino::fastled {

void ClocklessController::send(PixelController& pixels) {
    const std::span<std::uint8_t> bytes = wave_.bytes();
    std::size_t at = 0;
    pixels.for_each([&](std::uint8_t a, std::uint8_t b, std::uint8_t c) {
        for (const std::uint8_t level : {a, b, c}) bytes[at++] = level;
    });
    wave_.send(pin_, timing_, "FastLED.show");
}

namespace {

// WS2801 shows after 500 µs without a clock (data sheet); the others when their frame is complete.
constexpr Nanoseconds kQuiet{500'000};

std::uint32_t liked_clock(ESPIChipsets chip) {
    switch (chip) {
        case WS2801:
            return 1'000'000;
        case P9813:
            return 10'000'000;
        case WS2803:
            return 25'000'000;
        default:
            return 12'000'000;
    }
}

}  // namespace

ClockedController::ClockedController(ESPIChipsets chip, int data, int clock, EOrder order,
                                     std::uint32_t clock_hz)
    : chip_(chip),
      data_(data),
      clock_(clock),
      order_(order),
      clock_hz_(clock_hz == 0 ? liked_clock(chip) : clock_hz) {}

void ClockedController::init() {
    if (data_ == PIN_SPI_MOSI && clock_ == PIN_SPI_SCK) return;
    for (const int pin : {data_, clock_}) {
        pinMode(pin, OUTPUT);
        digitalWrite(pin, LOW);
    }
}

void ClockedController::resize(int count) {
    frame_.assign(static_cast<std::size_t>(4 * count + count / 16 + 16), 0);
}

void ClockedController::put(std::initializer_list<std::uint8_t> bytes) {
    for (const std::uint8_t byte : bytes) frame_[used_++] = byte;
}

void ClockedController::put_pixel(std::uint8_t a, std::uint8_t b, std::uint8_t c) {
    switch (chip_) {
        case APA102:
        case SK9822:
        case DOTSTAR:
            put({0xFF, a, b, c});
            return;  // the chip's own brightness is whole
        case P9813:  // the flag repeats the two highest bits of each, inverted
            put({static_cast<std::uint8_t>(0xC0 | (~c & 0xC0) >> 2 | (~b & 0xC0) >> 4 | (~a & 0xC0) >> 6), c,
                 b, a});
            return;
        case LPD8806: {  // seven bits, rounded
            const auto seven = [](std::uint8_t level) {
                return static_cast<std::uint8_t>(0x80 | std::min((level + 1) / 2, 127));
            };
            put({seven(a), seven(b), seven(c)});
            return;
        }
        default:
            put({a, b, c});
            return;
    }
}

void ClockedController::send(PixelController& pixels) {
    used_ = 0;
    const bool begins_with_zeros = chip_ == P9813 || chip_ >= APA102;
    if (begins_with_zeros) put({0, 0, 0, 0});
    pixels.for_each([this](std::uint8_t a, std::uint8_t b, std::uint8_t c) { put_pixel(a, b, c); });
    std::size_t zeros = begins_with_zeros ? 4 : 0;
    // A bit more for every second pixel: each hands the data on by half a clock later. (APA102's
    // data sheet has ones there, which a longer strip takes for a pixel.)
    if (chip_ >= APA102) zeros += (pixels.size() + 15) / 16;
    if (chip_ == LPD8806) zeros = (3 * pixels.size() + 63) / 64;
    std::fill_n(frame_.begin() + static_cast<std::ptrdiff_t>(used_), zeros, std::uint8_t{0});
    used_ += zeros;
    wait_until(ready_);
    transmit();
    if (chip_ == WS2801 || chip_ == WS2803) ready_ = board::current().now() + kQuiet;
}

void ClockedController::transmit() {
    board::Board& board = board::current();
    const std::span<std::uint8_t> sent(frame_.data(), used_);
    if (data_ == PIN_SPI_MOSI && clock_ == PIN_SPI_SCK) {
        succeeded("FastLED.show", data_, board.spi_transfer(board::SpiBus{0}, {.clock_hz = clock_hz_}, sent));
        return;
    }
    const board::PinId data{static_cast<std::uint16_t>(data_)}, clock{static_cast<std::uint16_t>(clock_)};
    const Nanoseconds half{500'000'000 / clock_hz_};
    Instant edge = board.now();
    for (const std::uint8_t byte : sent) {
        for (unsigned mask = 0x80; mask != 0; mask >>= 1, edge += 2 * half) {
            board.busy_until(edge);
            board.pin_write(data, (byte & mask) != 0 ? board::Level::high : board::Level::low);
            board.pin_write(clock, board::Level::low);
            board.busy_until(edge + half);
            board.pin_write(clock, board::Level::high);
        }
    }
    board.busy_until(edge);
    board.pin_write(clock, board::Level::low);
}

void AnalogController::init() {
    for (const int pin : pins_) pinMode(pin, OUTPUT);
}

void AnalogController::send(PixelController& pixels) {
    std::uint8_t levels[3] = {};
    bool is_first = true;
    pixels.for_each([&](std::uint8_t red, std::uint8_t green, std::uint8_t blue) {
        if (is_first) levels[0] = red, levels[1] = green, levels[2] = blue;
        is_first = false;
    });
    for (int i = 0; i < 3; ++i) analogWrite(pins_[i], levels[i]);
}

}  // namespace qduino::arduino::fastled
