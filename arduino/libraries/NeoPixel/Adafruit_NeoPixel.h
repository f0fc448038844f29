// Adafruit_NeoPixel: strips of WS2812 and the like, under the library's name. The library itself
// counts an AVR's clocks between two edges; here the board has the time.
// The wire may be on any pin, or on SPI (arduino/libraries/NeoPixel/pixel_wave.h).
//
// A colour is kept as it was set, so brightness may be changed to and fro.
#pragma once

#include <cstdint>
#include <vector>

#include "arduino/Arduino.h"
#include "arduino/libraries/NeoPixel/pixel_wave.h"

using neoPixelType = std::uint16_t;

// Where white, red, green and blue stand among a pixel's bytes: two bits each. White in red's
// place: there is none.
#define NEO_RGB 0x06
#define NEO_RBG 0x09
#define NEO_GRB 0x52
#define NEO_GBR 0xA1
#define NEO_BRG 0x58
#define NEO_BGR 0xA4
#define NEO_RGBW 0xC6
#define NEO_GRBW 0xD2
#define NEO_KHZ800 0x0000
#define NEO_KHZ400 0x0100

class Adafruit_NeoPixel {
  public:
    explicit Adafruit_NeoPixel(std::uint16_t pixels, std::int16_t pin = 6,
                               neoPixelType type = NEO_GRB + NEO_KHZ800);

    /// Setup-time.
    void begin();
    /// Sends all colours. In a loop with a budget it takes 30 µs of it for each pixel, and waits
    /// before it until the strip shows the last ones.
    void show();
    /// True when show() would not wait.
    [[nodiscard]] bool canShow() const { return wave_.shown(); }
    void setPin(std::int16_t pin);
    [[nodiscard]] std::int16_t getPin() const { return pin_; }
    /// Setup-time; all pixels are dark afterwards.
    void updateLength(std::uint16_t pixels);
    void updateType(neoPixelType type);

    void setPixelColor(std::uint16_t index, std::uint32_t color);
    void setPixelColor(std::uint16_t index, std::uint8_t red, std::uint8_t green, std::uint8_t blue,
                       std::uint8_t white = 0) {
        setPixelColor(index, Color(red, green, blue, white));
    }
    /// `count` pixels from `first` on; 0: all that follow.
    void fill(std::uint32_t color = 0, std::uint16_t first = 0, std::uint16_t count = 0);
    void clear() { fill(); }
    /// 0xWWRRGGBB, as it was set.
    [[nodiscard]] std::uint32_t getPixelColor(std::uint16_t index) const;
    /// The brightness of what show() sends from now on; 255 changes nothing.
    void setBrightness(std::uint8_t brightness) { brightness_ = brightness; }
    [[nodiscard]] std::uint8_t getBrightness() const { return brightness_; }
    [[nodiscard]] std::uint16_t numPixels() const { return static_cast<std::uint16_t>(colors_.size()); }

    static constexpr std::uint32_t Color(std::uint8_t red, std::uint8_t green, std::uint8_t blue,
                                         std::uint8_t white = 0) {
        return std::uint32_t{white} << 24 | std::uint32_t{red} << 16 | std::uint32_t{green} << 8 | blue;
    }
    /// `hue`: 65536 are the circle, from red by green and blue; the others 0 to 255.
    static std::uint32_t ColorHSV(std::uint16_t hue, std::uint8_t saturation = 255, std::uint8_t value = 255);
    /// As bright to the eye as `level` says: its power 2.6.
    static std::uint8_t gamma8(std::uint8_t level);
    static std::uint32_t gamma32(std::uint32_t color);
    /// The circle of hues, `circles` times along the strip; backwards where that is negative.
    void rainbow(std::uint16_t first_hue = 0, std::int8_t circles = 1, std::uint8_t saturation = 255,
                 std::uint8_t value = 255, bool to_the_eye = true);
    /// 0 to 255: one wave of a sine from 128 on, as `x` goes from 0 to 255.
    static std::uint8_t sine8(std::uint8_t x);

  private:
    void encode();

    std::int16_t pin_;
    neoPixelType type_;
    std::uint8_t brightness_ = 255;
    std::vector<std::uint32_t> colors_;
    qduino::arduino::PixelWave wave_;
};
