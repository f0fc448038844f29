#include "arduino/libraries/FastLED/fastled/palettes.h"

#include <algorithm>

namespace qduino::arduino::fastled {

void load_gradient(CRGB* entries, int count, TProgmemRGBGradientPalettePtr gradient) {
    // Where a palette of 16 has fewer colours than entries, each gets entries of its own.
    const auto entry_of = [count](int index) { return count == 256 ? index : index / 16; };
    int colors = 1;
    while (gradient[4 * (colors - 1)] != 255) ++colors;
    int last_used = -1;
    CRGB from(gradient[1], gradient[2], gradient[3]);
    for (int begin = 0; begin < 255;) {
        gradient += 4;
        const int end = gradient[0];
        const CRGB to(gradient[1], gradient[2], gradient[3]);
        int first = entry_of(begin), last = entry_of(end);
        if (count == 16 && colors < 16) {
            if (first <= last_used && last_used < 15) {
                first = last_used + 1;
                last = std::max(last, first);
            }
            last_used = last;
        }
        fill_gradient_RGB(entries, static_cast<std::uint16_t>(first), from, static_cast<std::uint16_t>(last),
                          to);
        begin = end;
        from = to;
    }
}

namespace {

/// As bright as that, and never black if neither is.
std::uint8_t dimmed(std::uint8_t level, std::uint8_t brightness) {
    return brightness == 255 ? level : scale8(level, brightness == 0 ? 0 : add8(brightness, 1));
}

}  // namespace
}  // namespace qduino::arduino::fastled

using qduino::arduino::fastled::dimmed;

CRGB ColorFromPalette(const CRGBPalette16& palette, std::uint8_t index, std::uint8_t brightness,
                      TBlendType mixed) {
    // The last colour is the last one.
    if (mixed == LINEARBLEND_NOWRAP) index = map8(index, 0, 239);
    const unsigned entry = index / 16u;
    const auto part = static_cast<std::uint8_t>(index % 16 * 16);
    CRGB color = palette[entry];
    if (part != 0 && mixed != NOBLEND) {
        color.nscale8(sub8(255, part));
        color += CRGB(palette[(entry + 1) % 16]).nscale8(part);
    }
    if (brightness == 0) return CRGB(0, 0, 0);
    return color.each([brightness](std::uint8_t level) { return dimmed(level, brightness); });
}

CRGB ColorFromPalette(const CRGBPalette256& palette, std::uint8_t index, std::uint8_t brightness,
                      TBlendType) {
    if (brightness == 0) return CRGB(0, 0, 0);
    return CRGB(palette[index]).each([brightness](std::uint8_t level) { return dimmed(level, brightness); });
}

CHSV ColorFromPalette(const CHSVPalette16& palette, std::uint8_t index, std::uint8_t brightness,
                      TBlendType mixed) {
    const unsigned entry = index / 16u;
    const auto part = static_cast<std::uint8_t>(index % 16 * 16);
    CHSV color = palette[entry];
    if (part != 0 && mixed != NOBLEND) {
        CHSV next = palette[(entry + 1) % 16];
        // Black and white have no hue of their own.
        if (color.s == 0 || color.v == 0) color.h = next.h;
        if (next.s == 0 || next.v == 0) next.h = color.h;
        const int turn = qduino::arduino::fastled::hue_distance(color.h, next.h, SHORTEST_HUES);
        const std::uint8_t way = scale8(static_cast<std::uint8_t>(turn < 0 ? -turn : turn), part);
        const std::uint8_t kept = sub8(255, part);
        color = CHSV(turn < 0 ? sub8(color.h, way) : add8(color.h, way),
                     add8(scale8(color.s, kept), scale8(next.s, part)),
                     add8(scale8(color.v, kept), scale8(next.v, part)));
    }
    if (brightness != 255) color.v = scale8_video(color.v, brightness);
    return color;
}

CHSV ColorFromPalette(const CHSVPalette256& palette, std::uint8_t index, std::uint8_t brightness,
                      TBlendType) {
    CHSV color = palette[index];
    if (brightness != 255) color.v = scale8_video(color.v, brightness);
    return color;
}

void UpscalePalette(const CRGBPalette16& from, CRGBPalette256& to) {
    for (int i = 0; i < 256; ++i) to[i] = ColorFromPalette(from, static_cast<std::uint8_t>(i));
}

void UpscalePalette(const CHSVPalette16& from, CHSVPalette256& to) {
    for (int i = 0; i < 256; ++i) to[i] = ColorFromPalette(from, static_cast<std::uint8_t>(i));
}

void nblendPaletteTowardPalette(CRGBPalette16& now, const CRGBPalette16& target, std::uint8_t most) {
    int changed = 0;
    for (int i = 0; i < 48 && changed < most; ++i) {
        std::uint8_t& level = now.entries[i / 3].raw[i % 3];
        const std::uint8_t wanted = target.entries[i / 3].raw[i % 3];
        if (level == wanted) continue;
        ++changed;
        level = level < wanted ? add8(level, 1) : std::max(wanted, sub8(level, level >= 2 ? 2 : 1));
    }
}

const TProgmemRGBPalette16 CloudColors_p = {CRGB::Blue,      CRGB::DarkBlue, CRGB::DarkBlue,  CRGB::DarkBlue,
                                            CRGB::DarkBlue,  CRGB::DarkBlue, CRGB::DarkBlue,  CRGB::DarkBlue,
                                            CRGB::Blue,      CRGB::DarkBlue, CRGB::SkyBlue,   CRGB::SkyBlue,
                                            CRGB::LightBlue, CRGB::White,    CRGB::LightBlue, CRGB::SkyBlue};

const TProgmemRGBPalette16 LavaColors_p = {CRGB::Black,   CRGB::Maroon,  CRGB::Black,  CRGB::Maroon,
                                           CRGB::DarkRed, CRGB::DarkRed, CRGB::Maroon, CRGB::DarkRed,
                                           CRGB::DarkRed, CRGB::DarkRed, CRGB::Red,    CRGB::Orange,
                                           CRGB::White,   CRGB::Orange,  CRGB::Red,    CRGB::DarkRed};

const TProgmemRGBPalette16 OceanColors_p = {
    CRGB::MidnightBlue, CRGB::DarkBlue,   CRGB::MidnightBlue, CRGB::Navy,
    CRGB::DarkBlue,     CRGB::MediumBlue, CRGB::SeaGreen,     CRGB::Teal,
    CRGB::CadetBlue,    CRGB::Blue,       CRGB::DarkCyan,     CRGB::CornflowerBlue,
    CRGB::Aquamarine,   CRGB::SeaGreen,   CRGB::Aqua,         CRGB::LightSkyBlue};

const TProgmemRGBPalette16 ForestColors_p = {
    CRGB::DarkGreen,  CRGB::DarkGreen,        CRGB::DarkOliveGreen,   CRGB::DarkGreen,
    CRGB::Green,      CRGB::ForestGreen,      CRGB::OliveDrab,        CRGB::Green,
    CRGB::SeaGreen,   CRGB::MediumAquamarine, CRGB::LimeGreen,        CRGB::YellowGreen,
    CRGB::LightGreen, CRGB::LawnGreen,        CRGB::MediumAquamarine, CRGB::ForestGreen};

const TProgmemRGBPalette16 RainbowColors_p = {0xFF0000, 0xD52A00, 0xAB5500, 0xAB7F00, 0xABAB00, 0x56D500,
                                              0x00FF00, 0x00D52A, 0x00AB55, 0x0056AA, 0x0000FF, 0x2A00D5,
                                              0x5500AB, 0x7F0081, 0xAB0055, 0xD5002B};

const TProgmemRGBPalette16 RainbowStripeColors_p = {0xFF0000, 0, 0xAB5500, 0, 0xABAB00, 0, 0x00FF00, 0,
                                                    0x00AB55, 0, 0x0000FF, 0, 0x5500AB, 0, 0xAB0055, 0};

const TProgmemRGBPalette16 PartyColors_p = {0x5500AB, 0x84007C, 0xB5004B, 0xE5001B, 0xE81700, 0xB84700,
                                            0xAB7700, 0xABAB00, 0xAB5500, 0xDD2200, 0xF2000E, 0xC2003E,
                                            0x8F0071, 0x5F00A1, 0x2F00D0, 0x0007F9};

const TProgmemRGBPalette16 HeatColors_p = {0x000000, 0x330000, 0x660000, 0x990000, 0xCC0000, 0xFF0000,
                                           0xFF3300, 0xFF6600, 0xFF9900, 0xFFCC00, 0xFFFF00, 0xFFFF33,
                                           0xFFFF66, 0xFFFF99, 0xFFFFCC, 0xFFFFFF};

const std::uint8_t Rainbow_gp[] = {0,   255, 0,   0,   32,  171, 85,  0,  64,  171, 171, 0,
                                   96,  0,   255, 0,   128, 0,   171, 85, 160, 0,   0,   255,
                                   192, 85,  0,   171, 224, 171, 0,   85, 255, 255, 0,   0};
