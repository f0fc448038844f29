// FastLED's arithmetic of bytes (its lib8tion): a byte is a fraction of 256, an angle of 256 parts,
// a level. Names and results are FastLED 3's, as its documentation defines them (fastled.io/docs,
// "lib8tion"), with its corrected scaling: a scale of 255 changes nothing.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>

using fract8 = std::uint8_t;    // of 256
using fract16 = std::uint16_t;  // of 65536
using sfract7 = std::int8_t;    // of 128
using sfract15 = std::int16_t;  // of 32768
using accum88 = std::uint16_t;  // eight bits before the point, eight behind it
using saccum78 = std::int16_t;  // the same, signed
using saccum87 = std::int16_t;  // seven behind the point
using accum1616 = std::uint32_t;

// ---- Sums that stay in their range --------------------------------------------------------------
constexpr std::uint8_t qadd8(std::uint8_t a, std::uint8_t b) {
    return static_cast<std::uint8_t>(std::min(a + b, 255));
}
constexpr std::int8_t qadd7(std::int8_t a, std::int8_t b) {
    return static_cast<std::int8_t>(std::clamp(a + b, -128, 127));
}
constexpr std::uint8_t qsub8(std::uint8_t a, std::uint8_t b) {
    return static_cast<std::uint8_t>(std::max(a - b, 0));
}
constexpr std::uint8_t qmul8(std::uint8_t a, std::uint8_t b) {
    return static_cast<std::uint8_t>(std::min(a * b, 255));
}

// ---- Sums that wrap -----------------------------------------------------------------------------
constexpr std::uint8_t add8(std::uint8_t a, std::uint8_t b) { return static_cast<std::uint8_t>(a + b); }
constexpr std::uint8_t sub8(std::uint8_t a, std::uint8_t b) { return static_cast<std::uint8_t>(a - b); }
constexpr std::uint8_t mul8(std::uint8_t a, std::uint8_t b) { return static_cast<std::uint8_t>(a * b); }
constexpr std::uint8_t mod8(std::uint8_t a, std::uint8_t by) { return static_cast<std::uint8_t>(a % by); }
/// (a + b) % by, the sum being a byte.
constexpr std::uint8_t addmod8(std::uint8_t a, std::uint8_t b, std::uint8_t by) {
    return mod8(add8(a, b), by);
}
constexpr std::uint8_t submod8(std::uint8_t a, std::uint8_t b, std::uint8_t by) {
    return mod8(sub8(a, b), by);
}
constexpr std::int8_t abs8(std::int8_t a) { return static_cast<std::int8_t>(a < 0 ? -a : a); }
constexpr std::uint8_t avg8(std::uint8_t a, std::uint8_t b) { return static_cast<std::uint8_t>((a + b) / 2); }
constexpr std::uint16_t avg16(std::uint16_t a, std::uint16_t b) {
    return static_cast<std::uint16_t>((std::uint32_t{a} + b) / 2);
}
/// The mean of two signed numbers: rounded down if `a` is even, else up.
constexpr std::int16_t avg15(std::int16_t a, std::int16_t b) {
    return static_cast<std::int16_t>((a >> 1) + (b >> 1) + (a & 1));
}
constexpr std::int8_t avg7(std::int8_t a, std::int8_t b) { return static_cast<std::int8_t>(avg15(a, b)); }
/// The root of `of`, rounded down.
constexpr std::uint8_t sqrt16(std::uint16_t of) {
    unsigned root = 0;
    for (unsigned bit = 0x80; bit != 0; bit >>= 1) {
        if ((root + bit) * (root + bit) <= of) root += bit;
    }
    return static_cast<std::uint8_t>(root);
}

// ---- Scaling ------------------------------------------------------------------------------------
constexpr std::uint8_t scale8(std::uint8_t value, fract8 scale) {
    return static_cast<std::uint8_t>(value * (scale + 1) >> 8);
}
/// Zero only if one of both is.
constexpr std::uint8_t scale8_video(std::uint8_t value, fract8 scale) {
    return static_cast<std::uint8_t>((value * scale >> 8) + (value != 0 && scale != 0 ? 1 : 0));
}
constexpr std::uint16_t scale16(std::uint16_t value, fract16 scale) {
    return static_cast<std::uint16_t>(std::uint64_t{value} * (std::uint32_t{scale} + 1) >> 16);
}
constexpr std::uint16_t scale16by8(std::uint16_t value, fract8 scale) {
    return static_cast<std::uint16_t>(std::uint32_t{value} * (scale + 1u) >> 8);
}
inline void nscale8x3(std::uint8_t& r, std::uint8_t& g, std::uint8_t& b, fract8 scale) {
    for (std::uint8_t* const level : {&r, &g, &b}) *level = scale8(*level, scale);
}
inline void nscale8x3_video(std::uint8_t& r, std::uint8_t& g, std::uint8_t& b, fract8 scale) {
    for (std::uint8_t* const level : {&r, &g, &b}) *level = scale8_video(*level, scale);
}
inline void nscale8x2(std::uint8_t& a, std::uint8_t& b, fract8 scale) {
    for (std::uint8_t* const level : {&a, &b}) *level = scale8(*level, scale);
}
/// So much of `b` in `a`: 0 is `a`, 255 is `b`.
constexpr std::uint8_t blend8(std::uint8_t a, std::uint8_t b, fract8 of_b) {
    return static_cast<std::uint8_t>((a * 256 + b + (b - a) * of_b) >> 8);
}

// ---- Levels as the eye sees them ----------------------------------------------------------------
constexpr std::uint8_t dim8_raw(std::uint8_t x) { return scale8(x, x); }
constexpr std::uint8_t dim8_video(std::uint8_t x) { return scale8_video(x, x); }
constexpr std::uint8_t dim8_lin(std::uint8_t x) {
    return (x & 0x80) != 0 ? scale8(x, x) : static_cast<std::uint8_t>((x + 1) / 2);
}
constexpr std::uint8_t brighten8_raw(std::uint8_t x) { return sub8(255, dim8_raw(sub8(255, x))); }
constexpr std::uint8_t brighten8_video(std::uint8_t x) { return sub8(255, dim8_video(sub8(255, x))); }
constexpr std::uint8_t brighten8_lin(std::uint8_t x) { return sub8(255, dim8_lin(sub8(255, x))); }

// ---- Between two values -------------------------------------------------------------------------
constexpr std::uint8_t lerp8by8(std::uint8_t a, std::uint8_t b, fract8 part) {
    return b > a ? add8(a, scale8(sub8(b, a), part)) : sub8(a, scale8(sub8(a, b), part));
}
namespace qduino::arduino::fastled {
/// `scale` takes a part of the way, which is never below 0.
template <typename Value, typename Part, typename Scale>
constexpr Value between(Value a, Value b, Part part, Scale scale) {
    const auto way = static_cast<std::uint16_t>(b > a ? b - a : a - b);
    return static_cast<Value>(b > a ? a + scale(way, part) : a - scale(way, part));
}
}  // namespace qduino::arduino::fastled
constexpr std::uint16_t lerp16by16(std::uint16_t a, std::uint16_t b, fract16 part) {
    return qduino::arduino::fastled::between(a, b, part, scale16);
}
constexpr std::uint16_t lerp16by8(std::uint16_t a, std::uint16_t b, fract8 part) {
    return qduino::arduino::fastled::between(a, b, part, scale16by8);
}
constexpr std::int16_t lerp15by16(std::int16_t a, std::int16_t b, fract16 part) {
    return qduino::arduino::fastled::between(a, b, part, scale16);
}
constexpr std::int16_t lerp15by8(std::int16_t a, std::int16_t b, fract8 part) {
    return qduino::arduino::fastled::between(a, b, part, scale16by8);
}
/// 0…255 as `from`…`to`; a range of hues may wrap.
constexpr std::uint8_t map8(std::uint8_t in, std::uint8_t from, std::uint8_t to) {
    return add8(scale8(in, sub8(to, from)), from);
}

// ---- Easing, and waves --------------------------------------------------------------------------
constexpr std::uint8_t ease8InOutQuad(std::uint8_t x) {
    const std::uint8_t half = (x & 0x80) != 0 ? sub8(255, x) : x;
    const std::uint8_t eased = mul8(2, scale8(half, half));
    return (x & 0x80) != 0 ? sub8(255, eased) : eased;
}
constexpr std::uint16_t ease16InOutQuad(std::uint16_t x) {
    const auto half = static_cast<std::uint16_t>((x & 0x8000) != 0 ? 65535 - x : x);
    const auto eased = static_cast<std::uint16_t>(2 * scale16(half, half));
    return static_cast<std::uint16_t>((x & 0x8000) != 0 ? 65535 - eased : eased);
}
/// 3x² - 2x³.
constexpr fract8 ease8InOutCubic(fract8 x) {
    const std::uint8_t square = scale8(x, x);
    const int eased = 3 * square - 2 * scale8(square, x);
    return static_cast<fract8>(std::min(eased, 255));
}
/// Half as steep at both ends, and one and a half times in the middle.
constexpr fract8 ease8InOutApprox(fract8 x) {
    if (x < 64) return static_cast<fract8>(x / 2);
    if (x > 191) return sub8(255, static_cast<fract8>((255 - x) / 2));
    return static_cast<fract8>(x - 32 + (x - 64) / 2);
}
/// Up in the first half, down in the second.
constexpr std::uint8_t triwave8(std::uint8_t x) { return mul8(2, (x & 0x80) != 0 ? sub8(255, x) : x); }
constexpr std::uint8_t quadwave8(std::uint8_t x) { return ease8InOutQuad(triwave8(x)); }
constexpr std::uint8_t cubicwave8(std::uint8_t x) { return ease8InOutCubic(triwave8(x)); }
constexpr std::uint8_t squarewave8(std::uint8_t x, std::uint8_t width = 128) {
    return x < width || width == 255 ? 255 : 0;
}
/// A sine of straight pieces, four for a quarter: 128 ± 127; off by 2 % at most.
std::uint8_t sin8(std::uint8_t angle);
inline std::uint8_t cos8(std::uint8_t angle) { return sin8(add8(angle, 64)); }
/// A sine of straight pieces, eight for a quarter: ± 32767; off by 0.69 % at most.
std::int16_t sin16(std::uint16_t angle);
inline std::int16_t cos16(std::uint16_t angle) { return sin16(static_cast<std::uint16_t>(angle + 16384)); }

// ---- Numbers by chance --------------------------------------------------------------------------
/// The generator's state: its next is 2053 times this, and 13849 more.
inline std::uint16_t rand16seed = 1337;
inline std::uint16_t random16() {
    return rand16seed = static_cast<std::uint16_t>(rand16seed * 2053u + 13849u);
}
inline std::uint16_t random16(std::uint16_t below) {
    return static_cast<std::uint16_t>(std::uint32_t{random16()} * below >> 16);
}
inline std::uint16_t random16(std::uint16_t from, std::uint16_t below) {
    return static_cast<std::uint16_t>(from + random16(static_cast<std::uint16_t>(below - from)));
}
/// Both bytes of it, added.
inline std::uint8_t random8() {
    const std::uint16_t next = random16();
    return static_cast<std::uint8_t>(next + (next >> 8));
}
inline std::uint8_t random8(std::uint8_t below) { return static_cast<std::uint8_t>(random8() * below >> 8); }
inline std::uint8_t random8(std::uint8_t from, std::uint8_t below) {
    return add8(from, random8(sub8(below, from)));
}
inline void random16_set_seed(std::uint16_t seed) { rand16seed = seed; }
inline std::uint16_t random16_get_seed() { return rand16seed; }
inline void random16_add_entropy(std::uint16_t more) {
    rand16seed = static_cast<std::uint16_t>(rand16seed + more);
}

// ---- Memory -------------------------------------------------------------------------------------
inline void* memmove8(void* to, const void* from, std::size_t bytes) { return std::memmove(to, from, bytes); }
inline void* memcpy8(void* to, const void* from, std::size_t bytes) { return std::memcpy(to, from, bytes); }
inline void* memset8(void* to, std::uint8_t value, std::size_t bytes) {
    return std::memset(to, value, bytes);
}
