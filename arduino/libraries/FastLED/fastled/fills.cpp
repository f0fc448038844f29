#include "arduino/libraries/FastLED/fastled/fills.h"

#include <cmath>

namespace qduino::arduino::fastled {

int hue_distance(std::uint8_t from, std::uint8_t to, TGradientDirectionCode direction) {
    const int forward = sub8(to, from);
    const bool longer = forward > 127;
    const bool back = direction == BACKWARD_HUES || (direction == SHORTEST_HUES && longer) ||
                      (direction == LONGEST_HUES && !longer);
    return back ? -static_cast<int>(static_cast<std::uint8_t>(256 - forward)) : forward;
}

Ramp::Ramp(const std::uint8_t (&from)[3], const int (&distance)[3], int steps) {
    for (int i = 0; i < 3; ++i) {
        at_[i] = static_cast<std::uint16_t>(from[i] << 8);
        step_[i] = static_cast<std::int16_t>(distance[i] * 128 / (steps == 0 ? 1 : steps) * 2);
    }
}

void Ramp::step() {
    for (int i = 0; i < 3; ++i) at_[i] = static_cast<std::uint16_t>(at_[i] + step_[i]);
}

}  // namespace qduino::arduino::fastled

void fill_gradient_RGB(CRGB* pixels, std::uint16_t from, CRGB from_color, std::uint16_t to, CRGB to_color) {
    using qduino::arduino::fastled::Ramp;
    if (to < from) {
        std::swap(from, to);
        std::swap(from_color, to_color);
    }
    const int distance[] = {to_color.r - from_color.r, to_color.g - from_color.g, to_color.b - from_color.b};
    qduino::arduino::fastled::fill_ramp(pixels, from, to, Ramp(from_color.raw, distance, to - from),
                                        [](const Ramp& at) { return CRGB(at[0], at[1], at[2]); });
}

void fill_gradient_RGB(CRGB* pixels, std::uint16_t count, const CRGB& a, const CRGB& b) {
    fill_gradient_RGB(pixels, 0, a, static_cast<std::uint16_t>(count - 1), b);
}

void fill_gradient_RGB(CRGB* pixels, std::uint16_t count, const CRGB& a, const CRGB& b, const CRGB& c) {
    const auto half = static_cast<std::uint16_t>(count / 2);
    fill_gradient_RGB(pixels, 0, a, half, b);
    fill_gradient_RGB(pixels, half, b, static_cast<std::uint16_t>(count - 1), c);
}

void fill_gradient_RGB(CRGB* pixels, std::uint16_t count, const CRGB& a, const CRGB& b, const CRGB& c,
                       const CRGB& d) {
    const auto third = static_cast<std::uint16_t>(count / 3),
               thirds = static_cast<std::uint16_t>(count * 2 / 3);
    fill_gradient_RGB(pixels, 0, a, third, b);
    fill_gradient_RGB(pixels, third, b, thirds, c);
    fill_gradient_RGB(pixels, thirds, c, static_cast<std::uint16_t>(count - 1), d);
}

void nscale8(CRGB* pixels, std::uint16_t count, std::uint8_t scale) {
    for (int i = 0; i < count; ++i) pixels[i].nscale8(scale);
}

void fadeToBlackBy(CRGB* pixels, std::uint16_t count, std::uint8_t by) {
    nscale8(pixels, count, sub8(255, by));
}

void nscale8_video(CRGB* pixels, std::uint16_t count, std::uint8_t scale) {
    for (int i = 0; i < count; ++i) pixels[i].nscale8_video(scale);
}

void fadeLightBy(CRGB* pixels, std::uint16_t count, std::uint8_t by) {
    nscale8_video(pixels, count, sub8(255, by));
}

void fadeUsingColor(CRGB* pixels, std::uint16_t count, const CRGB& mask) {
    for (int i = 0; i < count; ++i) pixels[i].nscale8(mask);
}

CRGB& nblend(CRGB& color, const CRGB& more, fract8 amount) {
    if (amount == 255) return color = more;
    if (amount == 0) return color;
    return color.each_with(more, [amount](std::uint8_t a, std::uint8_t b) { return blend8(a, b, amount); });
}

CHSV& nblend(CHSV& color, const CHSV& more, fract8 amount, TGradientDirectionCode direction) {
    if (amount == 255) return color = more;
    if (amount == 0) return color;
    const fract8 kept = sub8(255, amount);
    const int turn = qduino::arduino::fastled::hue_distance(color.h, more.h, direction);
    const std::uint8_t part = scale8(static_cast<std::uint8_t>(turn < 0 ? -turn : turn), amount);
    return color = CHSV(turn < 0 ? sub8(color.h, part) : add8(color.h, part),
                        add8(scale8(color.s, kept), scale8(more.s, amount)),
                        add8(scale8(color.v, kept), scale8(more.v, amount)));
}

void nblend(CRGB* pixels, const CRGB* more, std::uint16_t count, fract8 amount) {
    for (int i = 0; i < count; ++i) nblend(pixels[i], more[i], amount);
}

CRGB blend(const CRGB& a, const CRGB& b, fract8 amount) {
    CRGB mixed = a;
    return nblend(mixed, b, amount);
}

CHSV blend(const CHSV& a, const CHSV& b, fract8 amount, TGradientDirectionCode direction) {
    CHSV mixed = a;
    return nblend(mixed, b, amount, direction);
}

CRGB* blend(const CRGB* a, const CRGB* b, CRGB* to, std::uint16_t count, fract8 amount) {
    for (int i = 0; i < count; ++i) to[i] = blend(a[i], b[i], amount);
    return to;
}

void blur1d(CRGB* pixels, std::uint16_t count, fract8 amount) {
    qduino::arduino::fastled::blur_line(count, amount, [pixels](int i) -> CRGB& { return pixels[i]; });
}

std::uint8_t applyGamma_video(std::uint8_t level, float gamma) {
    const auto bent = static_cast<std::uint8_t>(std::pow(static_cast<float>(level) / 255.0F, gamma) * 255.0F);
    return level != 0 && bent == 0 ? 1 : bent;
}

CRGB applyGamma_video(const CRGB& color, float gamma) {
    return CRGB(color).each([gamma](std::uint8_t level) { return applyGamma_video(level, gamma); });
}

CRGB& napplyGamma_video(CRGB& color, float gamma) { return color = applyGamma_video(color, gamma); }

void napplyGamma_video(CRGB* pixels, std::uint16_t count, float gamma) {
    for (int i = 0; i < count; ++i) napplyGamma_video(pixels[i], gamma);
}
