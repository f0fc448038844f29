// FastLED's noise: Perlin's, in whole numbers. A lattice point is 256 (inoise8) or 65536 (inoise16)
// from the next, and between two of them the noise changes smoothly.
#pragma once

#include <cstdint>

#include "arduino/libraries/FastLED/fastled/colors.h"

/// 0…255.
std::uint8_t inoise8(std::uint16_t x, std::uint16_t y, std::uint16_t z);
std::uint8_t inoise8(std::uint16_t x, std::uint16_t y);
std::uint8_t inoise8(std::uint16_t x);
/// About -64…64.
std::int8_t inoise8_raw(std::uint16_t x, std::uint16_t y, std::uint16_t z);
std::int8_t inoise8_raw(std::uint16_t x, std::uint16_t y);
std::int8_t inoise8_raw(std::uint16_t x);
/// 0…65535.
std::uint16_t inoise16(std::uint32_t x, std::uint32_t y, std::uint32_t z);
std::uint16_t inoise16(std::uint32_t x, std::uint32_t y);
std::uint16_t inoise16(std::uint32_t x);
/// About ±18000.
std::int16_t inoise16_raw(std::uint32_t x, std::uint32_t y, std::uint32_t z);
std::int16_t inoise16_raw(std::uint32_t x, std::uint32_t y);
std::int16_t inoise16_raw(std::uint32_t x);

/// Adds noise to `count` bytes, from x on, `step` apart: each octave twice as fine and half as
/// strong.
void fill_raw_noise8(std::uint8_t* data, std::uint8_t count, std::uint8_t octaves, std::uint16_t x, int step,
                     std::uint16_t time);
void fill_raw_noise16into8(std::uint8_t* data, std::uint8_t count, std::uint8_t octaves, std::uint32_t x,
                           int step, std::uint32_t time);
/// Pixels whose hue and brightness are noise.
void fill_noise8(CRGB* pixels, int count, std::uint8_t octaves, std::uint16_t x, int step,
                 std::uint8_t hue_octaves, std::uint16_t hue_x, int hue_step, std::uint16_t time);
void fill_noise16(CRGB* pixels, int count, std::uint8_t octaves, std::uint16_t x, int step,
                  std::uint8_t hue_octaves, std::uint16_t hue_x, int hue_step, std::uint16_t time,
                  std::uint8_t hue_shift = 0);
