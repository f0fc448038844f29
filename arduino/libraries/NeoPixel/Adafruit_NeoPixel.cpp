#include "arduino/libraries/NeoPixel/Adafruit_NeoPixel.h"

#include <algorithm>
#include <cmath>

Adafruit_NeoPixel::Adafruit_NeoPixel(std::uint16_t pixels, std::int16_t pin, neoPixelType type)
    : pin_(pin), type_(type) {
    updateLength(pixels);
}

void Adafruit_NeoPixel::updateLength(std::uint16_t pixels) {
    colors_.assign(pixels, 0);
    const bool has_white = (type_ >> 6 & 3) != (type_ >> 4 & 3);
    wave_.resize(pixels * (has_white ? std::size_t{4} : std::size_t{3}));
}

void Adafruit_NeoPixel::updateType(neoPixelType type) {
    type_ = type;
    updateLength(numPixels());
}

void Adafruit_NeoPixel::begin() { setPin(pin_); }

void Adafruit_NeoPixel::setPin(std::int16_t pin) {
    pin_ = pin;
    qduino::arduino::PixelWave::begin(pin);
}

void Adafruit_NeoPixel::show() {
    if (pin_ < 0 || colors_.empty()) return;
    encode();
    const bool slow = (type_ & NEO_KHZ400) != 0;
    wave_.send(pin_, slow ? qduino::arduino::kWs2811Slow : qduino::arduino::kWs2812, "NeoPixel.show");
}

void Adafruit_NeoPixel::encode() {
    const auto place = [this](int shift) { return std::size_t{type_} >> shift & 3; };
    const std::span<std::uint8_t> bytes = wave_.bytes();
    const std::size_t size = bytes.size() / colors_.size();
    for (std::size_t i = 0; i < colors_.size(); ++i) {
        const auto level = [&](int shift) {
            return static_cast<std::uint8_t>((colors_[i] >> shift & 0xFF) * (brightness_ + 1u) >> 8);
        };
        std::uint8_t* const pixel = &bytes[i * size];
        if (size == 4) pixel[place(6)] = level(24);
        pixel[place(4)] = level(16);
        pixel[place(2)] = level(8);
        pixel[place(0)] = level(0);
    }
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

void Adafruit_NeoPixel::rainbow(std::uint16_t first_hue, std::int8_t circles, std::uint8_t saturation,
                                std::uint8_t value, bool to_the_eye) {
    const int count = numPixels();
    for (int i = 0; i < count; ++i) {
        const auto hue = static_cast<std::uint16_t>(first_hue + std::int64_t{i} * circles * 65536 / count);
        const std::uint32_t color = ColorHSV(hue, saturation, value);
        setPixelColor(static_cast<std::uint16_t>(i), to_the_eye ? gamma32(color) : color);
    }
}

std::uint8_t Adafruit_NeoPixel::sine8(std::uint8_t x) {
    return static_cast<std::uint8_t>((std::sin(x * PI / 128) + 1) * 127.5 + 0.5);
}
