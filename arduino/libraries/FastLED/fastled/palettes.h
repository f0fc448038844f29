// FastLED's palettes: a byte becomes a colour. One of 16 entries mixes its neighbours in 16 steps,
// and the last one with the first; one of 256 has each.
#pragma once

#include <concepts>
#include <cstdint>

#include "arduino/libraries/FastLED/fastled/fills.h"

using TProgmemRGBPalette16 = std::uint32_t[16];  // 0xRRGGBB each
using TProgmemHSVPalette16 = std::uint32_t[16];  // 0xHHSSVV each
using TProgmemPalette16 = TProgmemRGBPalette16;
/// A gradient: index, red, green, blue, again and again, until the index 255.
using TProgmemRGBGradientPalette_byte = const std::uint8_t;
using TProgmemRGBGradientPalettePtr = const std::uint8_t*;
using TDynamicRGBGradientPalettePtr = const std::uint8_t*;
#define DEFINE_GRADIENT_PALETTE(name) const std::uint8_t name[] =
#define DECLARE_GRADIENT_PALETTE(name) extern const std::uint8_t name[]

enum TBlendType : std::uint8_t { NOBLEND = 0, LINEARBLEND = 1, LINEARBLEND_NOWRAP = 2 };
#define BLEND LINEARBLEND

namespace qduino::arduino::fastled {

void load_gradient(CRGB* entries, int count, TProgmemRGBGradientPalettePtr gradient);

/// `Size` colours, and all that both kinds and both sizes have.
template <typename Color, int Size>
class Palette {
  public:
    Color entries[Size];

    template <std::integral Index>
    Color& operator[](Index i) {
        return entries[static_cast<std::uint8_t>(i)];
    }
    template <std::integral Index>
    const Color& operator[](Index i) const {
        return entries[static_cast<std::uint8_t>(i)];
    }
    operator Color*() { return entries; }
    bool operator==(const Palette& other) const {
        for (int i = 0; i < Size; ++i) {
            if (!(entries[i] == other.entries[i])) return false;
        }
        return true;
    }

  protected:
    Palette() = default;
    /// As whatever kind of colour `from` are.
    template <typename From>
    void take(const From* from) {
        for (int i = 0; i < Size; ++i) entries[i] = from[i];
    }
    /// A gradient through two, three or four colours.
    template <typename... Colors>
    void fill(const Colors&... colors) {
        fill_gradient(entries, Size, colors...);
    }
    template <typename... Colors>
    void fill_straight(const Colors&... colors) {
        fill_gradient_RGB(entries, Size, colors...);
    }
};

template <typename... Args>
concept Sixteen = sizeof...(Args) == 16;
template <typename... Args>
concept TwoToFour = sizeof...(Args) >= 2 && sizeof...(Args) <= 4;
template <typename Color>
concept Hsv = std::same_as<Color, CHSV>;
template <typename Color>
concept Rgb = !Hsv<Color> && std::convertible_to<Color, CRGB>;

}  // namespace qduino::arduino::fastled

class CHSVPalette16 : public qduino::arduino::fastled::Palette<CHSV, 16> {
  public:
    CHSVPalette16() = default;  // of any colours
    CHSVPalette16(const CHSV& color) { fill_solid(entries, 16, color); }
    template <qduino::arduino::fastled::Hsv... Colors>
    requires qduino::arduino::fastled::TwoToFour<Colors...> CHSVPalette16(const Colors&... colors) {
        fill(colors...);
    }
    template <qduino::arduino::fastled::Hsv... Colors>
    requires qduino::arduino::fastled::Sixteen<Colors...> CHSVPalette16(const Colors&... colors) {
        const CHSV all[] = {colors...};
        take(all);
    }
    CHSVPalette16(const TProgmemHSVPalette16& codes) {
        for (int i = 0; i < 16; ++i) {
            const CRGB bytes(codes[i]);
            entries[i] = CHSV(bytes.r, bytes.g, bytes.b);
        }
    }
};

class CRGBPalette16 : public qduino::arduino::fastled::Palette<CRGB, 16> {
  public:
    CRGBPalette16() = default;  // of any colours
    CRGBPalette16(const CRGB& color) { fill_solid(entries, 16, color); }
    CRGBPalette16(const CHSV& color) { fill_solid(entries, 16, CRGB(color)); }
    template <qduino::arduino::fastled::Hsv... Colors>
    requires qduino::arduino::fastled::TwoToFour<Colors...> CRGBPalette16(const Colors&... colors) {
        fill(colors...);
    }
    template <qduino::arduino::fastled::Rgb... Colors>
    requires qduino::arduino::fastled::TwoToFour<Colors...> CRGBPalette16(const Colors&... colors) {
        fill_straight(CRGB(colors)...);
    }
    template <typename... Colors>
    requires qduino::arduino::fastled::Sixteen<Colors...> CRGBPalette16(const Colors&... colors) {
        const CRGB all[] = {CRGB(colors)...};
        take(all);
    }
    CRGBPalette16(const CHSVPalette16& other) { take(other.entries); }
    CRGBPalette16(const TProgmemRGBPalette16& codes) { take(codes); }
    CRGBPalette16(TProgmemRGBGradientPalettePtr gradient) {
        qduino::arduino::fastled::load_gradient(entries, 16, gradient);
    }
    CRGBPalette16& loadDynamicGradientPalette(TDynamicRGBGradientPalettePtr gradient) {
        return *this = CRGBPalette16(gradient);
    }
};

class CHSVPalette256;
class CRGBPalette256;
/// 256 entries of 16: mixed, or 16 times each for hues.
void UpscalePalette(const CRGBPalette16& from, CRGBPalette256& to);
void UpscalePalette(const CHSVPalette16& from, CHSVPalette256& to);

class CHSVPalette256 : public qduino::arduino::fastled::Palette<CHSV, 256> {
  public:
    CHSVPalette256() = default;  // of any colours
    CHSVPalette256(const CHSVPalette16& from) { UpscalePalette(from, *this); }
    CHSVPalette256(const CHSV& color) { fill_solid(entries, 256, color); }
    template <qduino::arduino::fastled::Hsv... Colors>
    requires qduino::arduino::fastled::TwoToFour<Colors...> CHSVPalette256(const Colors&... colors) {
        fill(colors...);
    }
};

class CRGBPalette256 : public qduino::arduino::fastled::Palette<CRGB, 256> {
  public:
    CRGBPalette256() = default;  // of any colours
    CRGBPalette256(const CRGBPalette16& from) { UpscalePalette(from, *this); }
    CRGBPalette256(const TProgmemRGBPalette16& codes) : CRGBPalette256(CRGBPalette16(codes)) {}
    CRGBPalette256(const CHSVPalette256& other) { take(other.entries); }
    CRGBPalette256(TProgmemRGBGradientPalettePtr gradient) {
        qduino::arduino::fastled::load_gradient(entries, 256, gradient);
    }
    CRGBPalette256& loadDynamicGradientPalette(TDynamicRGBGradientPalettePtr gradient) {
        return *this = CRGBPalette256(gradient);
    }
    CRGBPalette256(const CRGB& color) { fill_solid(entries, 256, color); }
    template <qduino::arduino::fastled::Hsv... Colors>
    requires qduino::arduino::fastled::TwoToFour<Colors...> CRGBPalette256(const Colors&... colors) {
        fill(colors...);
    }
    template <qduino::arduino::fastled::Rgb... Colors>
    requires qduino::arduino::fastled::TwoToFour<Colors...> CRGBPalette256(const Colors&... colors) {
        fill_straight(CRGB(colors)...);
    }
};

CRGB ColorFromPalette(const CRGBPalette16& palette, std::uint8_t index, std::uint8_t brightness = 255,
                      TBlendType mixed = LINEARBLEND);
inline CRGB ColorFromPalette(const TProgmemRGBPalette16& palette, std::uint8_t index,
                             std::uint8_t brightness = 255, TBlendType mixed = LINEARBLEND) {
    return ColorFromPalette(CRGBPalette16(palette), index, brightness, mixed);
}
CRGB ColorFromPalette(const CRGBPalette256& palette, std::uint8_t index, std::uint8_t brightness = 255,
                      TBlendType mixed = NOBLEND);
CHSV ColorFromPalette(const CHSVPalette16& palette, std::uint8_t index, std::uint8_t brightness = 255,
                      TBlendType mixed = LINEARBLEND);
CHSV ColorFromPalette(const CHSVPalette256& palette, std::uint8_t index, std::uint8_t brightness = 255,
                      TBlendType mixed = NOBLEND);

/// Indexes from `index` on, `step` apart.
template <typename AnyPalette>
void fill_palette(CRGB* pixels, std::uint16_t count, std::uint8_t index, std::uint8_t step,
                  const AnyPalette& palette, std::uint8_t brightness = 255, TBlendType mixed = LINEARBLEND) {
    for (int i = 0; i < count; ++i, index = add8(index, step)) {
        pixels[i] = ColorFromPalette(palette, index, brightness, mixed);
    }
}
/// The whole palette over `count` pixels.
template <typename AnyPalette>
void fill_palette_circular(CRGB* pixels, std::uint16_t count, std::uint8_t index, const AnyPalette& palette,
                           std::uint8_t brightness = 255, TBlendType mixed = LINEARBLEND,
                           bool reversed = false) {
    if (count == 0) return;
    const unsigned step = 65536u / count;
    for (unsigned i = 0; i < count; ++i) {
        const auto turned = static_cast<std::uint8_t>(i * step >> 8);
        const std::uint8_t at = reversed ? sub8(index, turned) : add8(index, turned);
        pixels[i] = ColorFromPalette(palette, at, brightness, mixed);
    }
}
/// Each byte as its colour, over what was there where `opacity` is below 255.
template <typename AnyPalette>
void map_data_into_colors_through_palette(const std::uint8_t* data, std::uint16_t count, CRGB* pixels,
                                          const AnyPalette& palette, std::uint8_t brightness = 255,
                                          std::uint8_t opacity = 255, TBlendType mixed = LINEARBLEND) {
    for (int i = 0; i < count; ++i) {
        const CRGB color = ColorFromPalette(palette, data[i], brightness, mixed);
        if (opacity == 255) {
            pixels[i] = color;
        } else {
            pixels[i].nscale8(static_cast<std::uint8_t>(256 - opacity)) += CRGB(color).nscale8_video(opacity);
        }
    }
}

/// Some levels of `now` a little nearer to `target`: one up, or two down, `most` of them.
void nblendPaletteTowardPalette(CRGBPalette16& now, const CRGBPalette16& target, std::uint8_t most = 24);

// FastLED's own, with its values.
extern const TProgmemRGBPalette16 CloudColors_p, LavaColors_p, OceanColors_p, ForestColors_p, RainbowColors_p,
    RainbowStripeColors_p, PartyColors_p, HeatColors_p;
#define RainbowStripesColors_p RainbowStripeColors_p
extern const std::uint8_t Rainbow_gp[];
