// FastLED's colours: CRGB as a strip shows them, CHSV as people choose them. A level is 0 to 255,
// and hues are 256 a turn: HUE_RED is 0. Sums and scales keep each level in its range.
#pragma once

#include <cstdint>

#include "arduino/libraries/FastLED/fastled/color_names.h"
#include "arduino/libraries/FastLED/fastled/math8.h"

/// What a kind of LED has too much of, to be taken away: FastLED's own measurements.
enum LEDColorCorrection : std::uint32_t {
    TypicalSMD5050 = 0xFFB0F0,
    TypicalLEDStrip = 0xFFB0F0,
    Typical8mmPixel = 0xFFE08C,
    TypicalPixelString = 0xFFE08C,
    UncorrectedColor = 0xFFFFFF,
};

/// The white of a light (FastLED's documentation, "Color temperature values").
enum ColorTemperature : std::uint32_t {
    Candle = 0xFF9329,
    Tungsten40W = 0xFFC58F,
    Tungsten100W = 0xFFD6AA,
    Halogen = 0xFFF1E0,
    CarbonArc = 0xFFFAF4,
    HighNoonSun = 0xFFFFFB,
    DirectSunlight = 0xFFFFFF,
    OvercastSky = 0xC9E2FF,
    ClearBlueSky = 0x409CFF,
    WarmFluorescent = 0xFFF4E5,
    StandardFluorescent = 0xF4FFFA,
    CoolWhiteFluorescent = 0xD4EBFF,
    FullSpectrumFluorescent = 0xFFF4F2,
    GrowLightFluorescent = 0xFFEFF7,
    BlackLightFluorescent = 0xA700FF,
    MercuryVapor = 0xD8F7FF,
    SodiumVapor = 0xFFD1B2,
    MetalHalide = 0xF2FCFF,
    HighPressureSodium = 0xFFB74C,
    UncorrectedTemperature = 0xFFFFFF,
};

enum HSVHue : std::uint8_t {
    HUE_RED = 0,
    HUE_ORANGE = 32,
    HUE_YELLOW = 64,
    HUE_GREEN = 96,
    HUE_AQUA = 128,
    HUE_BLUE = 160,
    HUE_PURPLE = 192,
    HUE_PINK = 224,
};

struct CHSV {
    __extension__ union {
        __extension__ struct {
            union {
                std::uint8_t hue, h;
            };
            union {
                std::uint8_t saturation, sat, s;
            };
            union {
                std::uint8_t value, val, v;
            };
        };
        std::uint8_t raw[3];
    };

    CHSV() = default;  // of any colour
    constexpr CHSV(std::uint8_t hue_, std::uint8_t saturation_, std::uint8_t value_)
        : raw{hue_, saturation_, value_} {}
    CHSV& setHSV(std::uint8_t hue_, std::uint8_t saturation_, std::uint8_t value_) {
        return *this = CHSV(hue_, saturation_, value_);
    }
};

struct CRGB : qduino::arduino::fastled::ColorNames {
    __extension__ union {
        __extension__ struct {
            union {
                std::uint8_t r, red;
            };
            union {
                std::uint8_t g, green;
            };
            union {
                std::uint8_t b, blue;
            };
        };
        std::uint8_t raw[3];
    };

    CRGB() = default;  // of any colour
    constexpr CRGB(std::uint8_t red_, std::uint8_t green_, std::uint8_t blue_) : raw{red_, green_, blue_} {}
    /// 0xRRGGBB.
    constexpr CRGB(std::uint32_t code)
        : raw{static_cast<std::uint8_t>(code >> 16), static_cast<std::uint8_t>(code >> 8),
              static_cast<std::uint8_t>(code)} {}
    constexpr CRGB(HTMLColorCode code) : CRGB(static_cast<std::uint32_t>(code)) {}
    constexpr CRGB(LEDColorCorrection code) : CRGB(static_cast<std::uint32_t>(code)) {}
    constexpr CRGB(ColorTemperature code) : CRGB(static_cast<std::uint32_t>(code)) {}
    /// As hsv2rgb_rainbow() does it.
    CRGB(const CHSV& color);

    std::uint8_t& operator[](std::uint8_t i) { return raw[i]; }
    const std::uint8_t& operator[](std::uint8_t i) const { return raw[i]; }
    CRGB& setRGB(std::uint8_t red_, std::uint8_t green_, std::uint8_t blue_) {
        return *this = CRGB(red_, green_, blue_);
    }
    CRGB& setHSV(std::uint8_t hue, std::uint8_t saturation, std::uint8_t value) {
        return *this = CHSV(hue, saturation, value);
    }
    CRGB& setHue(std::uint8_t hue) { return *this = CHSV(hue, 255, 255); }
    CRGB& setColorCode(std::uint32_t code) { return *this = CRGB(code); }

    /// Each level as `change(level)`.
    template <typename Change>
    CRGB& each(Change change) {
        for (std::uint8_t& level : raw) level = static_cast<std::uint8_t>(change(level));
        return *this;
    }
    /// Each level as `change(level, the other's)`.
    template <typename Change>
    CRGB& each_with(const CRGB& other, Change change) {
        for (int i = 0; i < 3; ++i) raw[i] = static_cast<std::uint8_t>(change(raw[i], other.raw[i]));
        return *this;
    }
    CRGB& operator+=(const CRGB& other) { return each_with(other, qadd8); }
    CRGB& operator-=(const CRGB& other) { return each_with(other, qsub8); }
    CRGB& operator|=(const CRGB& other) {
        return each_with(other, [](std::uint8_t mine, std::uint8_t its) { return std::max(mine, its); });
    }
    CRGB& operator&=(const CRGB& other) {
        return each_with(other, [](std::uint8_t mine, std::uint8_t its) { return std::min(mine, its); });
    }
    CRGB& addToRGB(std::uint8_t more) { return *this += CRGB(more, more, more); }
    CRGB& subtractFromRGB(std::uint8_t less) { return *this -= CRGB(less, less, less); }
    CRGB& operator|=(std::uint8_t least) { return *this |= CRGB(least, least, least); }
    CRGB& operator&=(std::uint8_t most) { return *this &= CRGB(most, most, most); }
    CRGB& operator++() { return addToRGB(1); }
    CRGB& operator--() { return subtractFromRGB(1); }
    CRGB operator++(int) {
        const CRGB before = *this;
        ++*this;
        return before;
    }
    CRGB operator--(int) {
        const CRGB before = *this;
        --*this;
        return before;
    }
    CRGB& operator/=(std::uint8_t by) {
        return each([by](int level) { return level / by; });
    }
    CRGB& operator>>=(std::uint8_t by) {
        return each([by](int level) { return level >> by; });
    }
    CRGB& operator*=(std::uint8_t by) {
        return each([by](std::uint8_t level) { return qmul8(level, by); });
    }
    CRGB operator-() const { return CRGB(sub8(255, r), sub8(255, g), sub8(255, b)); }
    explicit operator bool() const { return r != 0 || g != 0 || b != 0; }

    CRGB& nscale8(std::uint8_t scale) { return nscale8(CRGB(scale, scale, scale)); }
    CRGB& nscale8(const CRGB& scales) { return each_with(scales, ::scale8); }
    [[nodiscard]] CRGB scale8(std::uint8_t scale) const { return CRGB(*this).nscale8(scale); }
    [[nodiscard]] CRGB scale8(const CRGB& scales) const { return CRGB(*this).nscale8(scales); }
    /// A level that is not 0 stays so.
    CRGB& nscale8_video(std::uint8_t scale) { return each_with(CRGB(scale, scale, scale), ::scale8_video); }
    CRGB& operator%=(std::uint8_t scale) { return nscale8_video(scale); }
    CRGB& fadeLightBy(std::uint8_t by) { return nscale8_video(sub8(255, by)); }
    CRGB& fadeToBlackBy(std::uint8_t by) { return nscale8(sub8(255, by)); }

    /// How bright it is to the eye (ITU-R BT.709: 0.2126, 0.7152, 0.0722).
    [[nodiscard]] std::uint8_t getLuma() const;
    [[nodiscard]] std::uint8_t getAverageLight() const;
    /// The same hue, with its highest level at `limit`.
    void maximizeBrightness(std::uint8_t limit = 255);
    [[nodiscard]] CRGB lerp8(const CRGB& other, fract8 part) const {
        return CRGB(*this).each_with(
            other, [part](std::uint8_t mine, std::uint8_t its) { return lerp8by8(mine, its, part); });
    }
};

inline bool operator==(const CRGB& a, const CRGB& b) { return a.r == b.r && a.g == b.g && a.b == b.b; }
inline bool operator==(const CHSV& a, const CHSV& b) { return a.h == b.h && a.s == b.s && a.v == b.v; }
inline CRGB operator+(CRGB a, const CRGB& b) { return a += b; }
inline CRGB operator-(CRGB a, const CRGB& b) { return a -= b; }
inline CRGB operator*(CRGB a, std::uint8_t by) { return a *= by; }
inline CRGB operator/(CRGB a, std::uint8_t by) { return a /= by; }
inline CRGB operator%(CRGB a, std::uint8_t by) { return a.nscale8_video(by); }
inline CRGB operator&(CRGB a, const CRGB& b) { return a &= b; }
inline CRGB operator|(CRGB a, const CRGB& b) { return a |= b; }

/// Eight hues as far from each other as the eye sees them: more yellow and orange than physics has.
void hsv2rgb_rainbow(const CHSV& from, CRGB& to);
/// Three ramps of the whole turn, as physics has it.
void hsv2rgb_spectrum(const CHSV& from, CRGB& to);
/// The same with 192 hues a turn.
void hsv2rgb_raw(const CHSV& from, CRGB& to);
void hsv2rgb_rainbow(const CHSV* from, CRGB* to, int count);
void hsv2rgb_spectrum(const CHSV* from, CRGB* to, int count);
void hsv2rgb_raw(const CHSV* from, CRGB* to, int count);

/// As hot bodies glow: black, red, yellow, white.
CRGB HeatColor(std::uint8_t temperature);
