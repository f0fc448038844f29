// FastLED: strips of coloured LEDs, and the arithmetic of their patterns, under the library's name.
// The library itself takes a computer for a board that has no pins. Here its names and results are
// FastLED 3's, and a strip of WS2812 is sent as Adafruit_NeoPixel.h sends it: by the calling loop
// on any pin, or by SPI on pin 51 (arduino/libraries/NeoPixel/pixel_wave.h). Strips with a clock
// are on any two pins, or by SPI on pins 51 and 52.
//
// In a loop with a budget show() takes 30 µs of it for each WS2812, and first waits until the strip
// shows the last frame.
#pragma once

#include "arduino/Arduino.h"
#include "arduino/libraries/FastLED/fastled/colors.h"
#include "arduino/libraries/FastLED/fastled/controllers.h"
#include "arduino/libraries/FastLED/fastled/every_n.h"
#include "arduino/libraries/FastLED/fastled/fills.h"
#include "arduino/libraries/FastLED/fastled/math8.h"
#include "arduino/libraries/FastLED/fastled/noise.h"
#include "arduino/libraries/FastLED/fastled/palettes.h"
#include "arduino/libraries/FastLED/fastled/pixel_set.h"

#define FASTLED_VERSION 3010003
#define FASTLED_USING_NAMESPACE
#define FL_PROGMEM
#define FL_PGM_READ_BYTE_NEAR(address) (*(address))
#define FL_PGM_READ_WORD_NEAR(address) (*(address))
#define FL_PGM_READ_DWORD_NEAR(address) (*(address))
#define DATA_RATE_MHZ(x) ((x)*1000000u)
#define DATA_RATE_KHZ(x) ((x)*1000u)

/// The brightness at which all strips together take so much, at most `brightness`. Measured by
/// FastLED's authors: a level of 255 takes 16, 11 and 15 mA at 5 V (red, green, blue), a dark pixel
/// 1 mA, a small board 25 mA.
std::uint8_t calculate_max_brightness_for_power_mW(std::uint8_t brightness, std::uint32_t milliwatts);
std::uint32_t calculate_unscaled_power_mW(const CRGB* pixels, std::uint16_t count);

class CFastLED {
  public:
    // ---- Strips. Setup-time. So many pixels, from `pixels` on; or `length` of them from an offset
    static CLEDController& addLeds(CLEDController* strip, CRGB* pixels, int count_or_offset, int length = 0);

    template <template <std::uint8_t, EOrder> class Chip, std::uint8_t DataPin, EOrder Order = RGB>
    static CLEDController& addLeds(CRGB* pixels, int count_or_offset, int length = 0) {
        static Chip<DataPin, Order> strip;
        return addLeds(&strip, pixels, count_or_offset, length);
    }
    template <template <std::uint8_t> class Chip, std::uint8_t DataPin>
    static CLEDController& addLeds(CRGB* pixels, int count_or_offset, int length = 0) {
        static Chip<DataPin> strip;
        return addLeds(&strip, pixels, count_or_offset, length);
    }
    template <template <std::uint8_t, std::uint8_t, std::uint8_t> class Chip, std::uint8_t RedPin,
              std::uint8_t GreenPin, std::uint8_t BluePin>
    static CLEDController& addLeds(CRGB* pixels, int count_or_offset, int length = 0) {
        static Chip<RedPin, GreenPin, BluePin> strip;
        return addLeds(&strip, pixels, count_or_offset, length);
    }
    template <ESPIChipsets Chip, std::uint8_t DataPin, std::uint8_t ClockPin, EOrder Order = RGB,
              std::uint32_t ClockHz = 0>
    static CLEDController& addLeds(CRGB* pixels, int count_or_offset, int length = 0) {
        static qduino::arduino::fastled::ClockedController strip(Chip, DataPin, ClockPin, Order, ClockHz);
        return addLeds(&strip, pixels, count_or_offset, length);
    }
    template <ESPIChipsets Chip, EOrder Order = RGB, std::uint32_t ClockHz = 0>
    static CLEDController& addLeds(CRGB* pixels, int count_or_offset, int length = 0) {
        return addLeds<Chip, PIN_SPI_MOSI, PIN_SPI_SCK, Order, ClockHz>(pixels, count_or_offset, length);
    }

    // ---- Frames
    void show(std::uint8_t brightness);
    void show() { show(brightness_); }
    /// All strips in one colour; the pixels stay as they are.
    void showColor(const CRGB& color, std::uint8_t brightness);
    void showColor(const CRGB& color) { showColor(color, brightness_); }
    /// All pixels black; `shown`: at once.
    void clear(bool shown = false);
    void clearData() { clear(); }
    /// Waits, and shows again meanwhile: that is what dithering wants.
    void delay(unsigned long ms);

    // ---- Of all strips
    void setBrightness(std::uint8_t brightness) { brightness_ = brightness; }
    [[nodiscard]] std::uint8_t getBrightness() const { return brightness_; }
    static void setCorrection(const CRGB& correction);
    static void setTemperature(const CRGB& temperature);
    /// BINARY_DITHER (the default) or DISABLE_DITHER. Below 100 frames a second there is none.
    static void setDither(EDitherMode mode = BINARY_DITHER);
    void setMaxPowerInMilliWatts(std::uint32_t milliwatts) { most_milliwatts_ = milliwatts; }
    void setMaxPowerInVoltsAndMilliamps(std::uint8_t volts, std::uint32_t milliamps) {
        setMaxPowerInMilliWatts(volts * milliamps);
    }
    /// show() waits until the last frame is so old. `constrain`: but never makes it faster.
    void setMaxRefreshRate(std::uint16_t per_second, bool constrain = false);
    /// The rate of the last 25 frames, in frames a second.
    [[nodiscard]] std::uint16_t getFPS() const { return frames_per_second_; }
    void countFPS(int frames = 25);

    // ---- The strips
    [[nodiscard]] static int count();
    CLEDController& operator[](int strip) const;
    /// The number of pixels of the first strip; leds(): these pixels.
    [[nodiscard]] static int size();
    [[nodiscard]] static CRGB* leds();

  private:
    template <typename Show>
    void show_each(std::uint8_t brightness, Show show_one);

    std::uint8_t brightness_ = 255;
    std::uint32_t most_milliwatts_ = 0;  // 0: whatever they take
    qduino::Nanoseconds least_interval_{};
    qduino::Instant last_frame_{};
    std::uint16_t frames_per_second_ = 0;
    int counted_ = 0;
    qduino::Instant counted_from_{};
};

extern CFastLED FastLED;

// The names of before FastLED 3.
#define FastSPI_LED FastLED
#define LEDS FastLED
inline void set_max_power_in_volts_and_milliamps(std::uint8_t volts, std::uint32_t milliamps) {
    FastLED.setMaxPowerInVoltsAndMilliamps(volts, milliamps);
}
inline void set_max_power_in_milliwatts(std::uint32_t milliwatts) {
    FastLED.setMaxPowerInMilliWatts(milliwatts);
}
/// A pin that is high while the limit holds brightness down; 0: none.
void set_max_power_indicator_LED(std::uint8_t pin);
inline void show_at_max_brightness_for_power() { FastLED.show(); }
inline void delay_at_max_brightness_for_power(std::uint16_t ms) { FastLED.delay(ms); }
