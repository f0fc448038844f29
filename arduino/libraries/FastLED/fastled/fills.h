// What FastLED does with many pixels at once: fills, fades, blends, blurs. Arrays are `count` long
// from their pointer on.
#pragma once

#include <cstdint>
#include <utility>

#include "arduino/libraries/FastLED/fastled/colors.h"

template <typename Pixel>
void fill_solid(Pixel* pixels, int count, const Pixel& color) {
    for (int i = 0; i < count; ++i) pixels[i] = color;
}
/// `color` is whatever a pixel may be made of: CRGB::Red, 0xFF0000, a CHSV.
inline void fill_solid(CRGB* pixels, int count, const CRGB& color) { fill_solid<CRGB>(pixels, count, color); }
inline void fill_solid(CHSV* pixels, int count, const CHSV& color) { fill_solid<CHSV>(pixels, count, color); }

/// Hues from `hue` on, each `step` behind the last, a little less than saturated (240).
template <typename Pixel>
void fill_rainbow(Pixel* pixels, int count, std::uint8_t hue, std::uint8_t step = 5) {
    for (int i = 0; i < count; ++i, hue = add8(hue, step)) pixels[i] = CHSV(hue, 240, 255);
}
/// The whole turn of hues over `count` pixels.
template <typename Pixel>
void fill_rainbow_circular(Pixel* pixels, int count, std::uint8_t hue, bool reversed = false) {
    if (count <= 0) return;
    const auto step = static_cast<std::uint16_t>(65536 / count);
    std::uint16_t offset = 0;
    for (int i = 0; i < count; ++i) {
        const auto turned = static_cast<std::uint8_t>(offset >> 8);
        pixels[i] = CHSV(reversed ? sub8(hue, turned) : add8(hue, turned), 240, 255);
        offset = static_cast<std::uint16_t>(offset + step);
    }
}

/// Which way round the circle of hues.
enum TGradientDirectionCode : std::uint8_t { FORWARD_HUES, BACKWARD_HUES, SHORTEST_HUES, LONGEST_HUES };

namespace qduino::arduino::fastled {

/// How far `to` is from `from` in that direction: below 0 is backwards.
int hue_distance(std::uint8_t from, std::uint8_t to, TGradientDirectionCode direction);

/// Three numbers on their way from one colour to another, in 256ths of a level: each step is a
/// whole number of 128ths, doubled, as FastLED has it.
class Ramp {
  public:
    Ramp(const std::uint8_t (&from)[3], const int (&distance)[3], int steps);
    [[nodiscard]] std::uint8_t operator[](int i) const { return static_cast<std::uint8_t>(at_[i] >> 8); }
    void step();

  private:
    std::uint16_t at_[3];
    std::int16_t step_[3];
};

/// Fills from one index to another, both with it, by `make(ramp)`.
template <typename Pixel, typename Make>
void fill_ramp(Pixel* pixels, int from, int to, Ramp ramp, Make make) {
    for (int i = from; i <= to; ++i, ramp.step()) pixels[i] = make(ramp);
}

}  // namespace qduino::arduino::fastled

/// From one colour to another through the hues, both ends with it. What is black or white has the
/// other's hue.
template <typename Pixel>
void fill_gradient(Pixel* pixels, std::uint16_t from, CHSV from_color, std::uint16_t to, CHSV to_color,
                   TGradientDirectionCode direction = SHORTEST_HUES) {
    if (to < from) {
        std::swap(from, to);
        std::swap(from_color, to_color);
    }
    if (to_color.v == 0 || to_color.s == 0) to_color.h = from_color.h;
    if (from_color.v == 0 || from_color.s == 0) from_color.h = to_color.h;
    const int distance[] = {qduino::arduino::fastled::hue_distance(from_color.h, to_color.h, direction),
                            to_color.s - from_color.s, to_color.v - from_color.v};
    using qduino::arduino::fastled::Ramp;
    qduino::arduino::fastled::fill_ramp(pixels, from, to, Ramp(from_color.raw, distance, to - from),
                                        [](const Ramp& at) { return CHSV(at[0], at[1], at[2]); });
}
template <typename Pixel>
void fill_gradient(Pixel* pixels, std::uint16_t count, const CHSV& a, const CHSV& b,
                   TGradientDirectionCode direction = SHORTEST_HUES) {
    fill_gradient(pixels, 0, a, static_cast<std::uint16_t>(count - 1), b, direction);
}
template <typename Pixel>
void fill_gradient(Pixel* pixels, std::uint16_t count, const CHSV& a, const CHSV& b, const CHSV& c,
                   TGradientDirectionCode direction = SHORTEST_HUES) {
    const auto half = static_cast<std::uint16_t>(count / 2);
    fill_gradient(pixels, 0, a, half, b, direction);
    fill_gradient(pixels, half, b, static_cast<std::uint16_t>(count - 1), c, direction);
}
template <typename Pixel>
void fill_gradient(Pixel* pixels, std::uint16_t count, const CHSV& a, const CHSV& b, const CHSV& c,
                   const CHSV& d, TGradientDirectionCode direction = SHORTEST_HUES) {
    const auto third = static_cast<std::uint16_t>(count / 3),
               thirds = static_cast<std::uint16_t>(count * 2 / 3);
    fill_gradient(pixels, 0, a, third, b, direction);
    fill_gradient(pixels, third, b, thirds, c, direction);
    fill_gradient(pixels, thirds, c, static_cast<std::uint16_t>(count - 1), d, direction);
}
#define fill_gradient_HSV fill_gradient

/// The same straight from colour to colour.
void fill_gradient_RGB(CRGB* pixels, std::uint16_t from, CRGB from_color, std::uint16_t to, CRGB to_color);
void fill_gradient_RGB(CRGB* pixels, std::uint16_t count, const CRGB& a, const CRGB& b);
void fill_gradient_RGB(CRGB* pixels, std::uint16_t count, const CRGB& a, const CRGB& b, const CRGB& c);
void fill_gradient_RGB(CRGB* pixels, std::uint16_t count, const CRGB& a, const CRGB& b, const CRGB& c,
                       const CRGB& d);

/// Darker, and black in the end.
void nscale8(CRGB* pixels, std::uint16_t count, std::uint8_t scale);
void fadeToBlackBy(CRGB* pixels, std::uint16_t count, std::uint8_t by);
inline void fade_raw(CRGB* pixels, std::uint16_t count, std::uint8_t by) { fadeToBlackBy(pixels, count, by); }
/// Darker; a level that is not 0 stays so.
void nscale8_video(CRGB* pixels, std::uint16_t count, std::uint8_t scale);
void fadeLightBy(CRGB* pixels, std::uint16_t count, std::uint8_t by);
inline void fade_video(CRGB* pixels, std::uint16_t count, std::uint8_t by) { fadeLightBy(pixels, count, by); }
/// Looks as if seen through a glass of that colour.
void fadeUsingColor(CRGB* pixels, std::uint16_t count, const CRGB& mask);

/// So much of `more` in `color`: 0 changes nothing, 255 is `more`.
CRGB& nblend(CRGB& color, const CRGB& more, fract8 amount);
CHSV& nblend(CHSV& color, const CHSV& more, fract8 amount, TGradientDirectionCode direction = SHORTEST_HUES);
void nblend(CRGB* pixels, const CRGB* more, std::uint16_t count, fract8 amount);
CRGB blend(const CRGB& a, const CRGB& b, fract8 amount);
CHSV blend(const CHSV& a, const CHSV& b, fract8 amount, TGradientDirectionCode direction = SHORTEST_HUES);
CRGB* blend(const CRGB* a, const CRGB* b, CRGB* to, std::uint16_t count, fract8 amount);

/// Each pixel gives of its light to its neighbours. 64 is moderate, and above 172 it flickers.
/// Light is lost each time.
void blur1d(CRGB* pixels, std::uint16_t count, fract8 amount);

/// The sketch's: which pixel is at that place of its matrix.
std::uint16_t XY(std::uint8_t x, std::uint8_t y);
namespace qduino::arduino::fastled {
/// A blur along a line whose pixels are `pixel(0)` to `pixel(count - 1)`.
template <typename PixelAt>
void blur_line(int count, fract8 amount, PixelAt pixel) {
    CRGB carried(0, 0, 0);
    for (int i = 0; i < count; ++i) {
        CRGB seeps = pixel(i);
        seeps.nscale8(static_cast<std::uint8_t>(amount >> 1));
        if (i != 0) pixel(i - 1) += seeps;
        pixel(i).nscale8(sub8(255, amount)) += carried;
        carried = seeps;
    }
}
}  // namespace qduino::arduino::fastled
inline void blurRows(CRGB* pixels, std::uint8_t width, std::uint8_t height, fract8 amount) {
    for (std::uint8_t y = 0; y < height; ++y) {
        qduino::arduino::fastled::blur_line(
            width, amount, [&](int x) -> CRGB& { return pixels[XY(static_cast<std::uint8_t>(x), y)]; });
    }
}
inline void blurColumns(CRGB* pixels, std::uint8_t width, std::uint8_t height, fract8 amount) {
    for (std::uint8_t x = 0; x < width; ++x) {
        qduino::arduino::fastled::blur_line(
            height, amount, [&](int y) -> CRGB& { return pixels[XY(x, static_cast<std::uint8_t>(y))]; });
    }
}
inline void blur2d(CRGB* pixels, std::uint8_t width, std::uint8_t height, fract8 amount) {
    blurRows(pixels, width, height, amount);
    blurColumns(pixels, width, height, amount);
}

/// Brighter or darker, with black and white where they were; a level that is not 0 stays so.
std::uint8_t applyGamma_video(std::uint8_t level, float gamma);
CRGB applyGamma_video(const CRGB& color, float gamma);
CRGB& napplyGamma_video(CRGB& color, float gamma);
void napplyGamma_video(CRGB* pixels, std::uint16_t count, float gamma);
