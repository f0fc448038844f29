#include "arduino/libraries/FastLED/fastled/colors.h"

#include <algorithm>

CRGB::CRGB(const CHSV& color) { hsv2rgb_rainbow(color, *this); }

std::uint8_t CRGB::getLuma() const {
    return static_cast<std::uint8_t>(::scale8(r, 54) + ::scale8(g, 183) + ::scale8(b, 18));
}

std::uint8_t CRGB::getAverageLight() const {
    return static_cast<std::uint8_t>(::scale8(r, 86) + ::scale8(g, 86) + ::scale8(b, 86));
}

void CRGB::maximizeBrightness(std::uint8_t limit) {
    const int highest = std::max({r, g, b});
    if (highest == 0) return;
    const int factor = limit * 256 / highest;
    each([factor](int level) { return level * factor / 256; });
}

namespace {

/// A hue at its brightest. Red falls by a third to orange, by two thirds from yellow to green …:
/// each eighth of the turn changes a level by a third of 256, or by two (FastLED's documentation,
/// "FastLED HSV Colors": the rainbow with boosted yellow, 171 of 255 in both).
CRGB rainbow_hue(std::uint8_t hue) {
    const auto within = static_cast<std::uint8_t>(hue % 32 * 8);
    const std::uint8_t third = scale8(within, 85), thirds = scale8(within, 170);
    const auto level = [](int value) { return static_cast<std::uint8_t>(value); };
    switch (hue / 32) {
        case 0:
            return CRGB(level(255 - third), third, 0);  // red to orange
        case 1:
            return CRGB(171, level(85 + third), 0);  // to yellow
        case 2:
            return CRGB(level(171 - thirds), level(170 + third), 0);  // to green
        case 3:
            return CRGB(0, level(255 - third), third);  // to aqua
        case 4:
            return CRGB(0, level(171 - thirds), level(85 + thirds));  // to blue
        case 5:
            return CRGB(third, 0, level(255 - third));  // to purple
        case 6:
            return CRGB(level(85 + third), 0, level(171 - third));  // to pink
        default:
            return CRGB(level(170 + third), 0, level(85 - third));  // to red
    }
}

template <typename Convert>
void convert_all(const CHSV* from, CRGB* to, int count, Convert convert) {
    for (int i = 0; i < count; ++i) convert(from[i], to[i]);
}

}  // namespace

void hsv2rgb_rainbow(const CHSV& from, CRGB& to) {
    // What saturation lacks is white, by its square; so is brightness.
    const std::uint8_t white = scale8_video(sub8(255, from.s), sub8(255, from.s));
    CRGB color = from.s == 0 ? CRGB(255, 255, 255) : rainbow_hue(from.h);
    if (from.s != 0 && from.s != 255) {
        color.nscale8(sub8(255, white)).each([white](int level) { return level + white; });
    }
    if (from.v != 255) color.nscale8(scale8_video(from.v, from.v));
    to = from.v == 0 ? CRGB(0, 0, 0) : color;
}

void hsv2rgb_raw(const CHSV& from, CRGB& to) {
    const int floor = from.v * (255 - from.s) / 256, height = from.v - floor;
    const int within = from.h % 64;
    const auto up = static_cast<std::uint8_t>(floor + within * height / 64);
    const auto down = static_cast<std::uint8_t>(floor + (63 - within) * height / 64);
    const auto least = static_cast<std::uint8_t>(floor);
    switch (from.h / 64) {
        case 0:
            to = CRGB(down, up, least);
            return;
        case 1:
            to = CRGB(least, down, up);
            return;
        default:
            to = CRGB(up, least, down);
            return;
    }
}

void hsv2rgb_spectrum(const CHSV& from, CRGB& to) {
    hsv2rgb_raw(CHSV(scale8(from.h, 191), from.s, from.v), to);
}

void hsv2rgb_rainbow(const CHSV* from, CRGB* to, int count) {
    convert_all(from, to, count, [](const CHSV& one, CRGB& other) { hsv2rgb_rainbow(one, other); });
}
void hsv2rgb_spectrum(const CHSV* from, CRGB* to, int count) {
    convert_all(from, to, count, [](const CHSV& one, CRGB& other) { hsv2rgb_spectrum(one, other); });
}
void hsv2rgb_raw(const CHSV* from, CRGB* to, int count) {
    convert_all(from, to, count, [](const CHSV& one, CRGB& other) { hsv2rgb_raw(one, other); });
}

CRGB HeatColor(std::uint8_t temperature) {
    // Three thirds of 64 steps, of four levels each.
    const std::uint8_t heat = scale8_video(temperature, 191);
    const auto ramp = static_cast<std::uint8_t>(heat % 64 * 4);
    if (heat >= 128) return CRGB(255, 255, ramp);
    return heat >= 64 ? CRGB(255, ramp, 0) : CRGB(ramp, 0, 0);
}
