#include "arduino/libraries/FastLED/fastled/noise.h"

#include <algorithm>
#include <array>
#include <cstddef>

// K. Perlin, "Improving Noise" (SIGGRAPH 2002), and the table of his reference implementation. What
// is FastLED's own is the width of the numbers, and how they are rounded.

namespace {

constexpr std::uint8_t kOrder[256] = {
    151, 160, 137, 91,  90,  15,  131, 13,  201, 95,  96,  53,  194, 233, 7,   225, 140, 36,  103, 30,
    69,  142, 8,   99,  37,  240, 21,  10,  23,  190, 6,   148, 247, 120, 234, 75,  0,   26,  197, 62,
    94,  252, 219, 203, 117, 35,  11,  32,  57,  177, 33,  88,  237, 149, 56,  87,  174, 20,  125, 136,
    171, 168, 68,  175, 74,  165, 71,  134, 139, 48,  27,  166, 77,  146, 158, 231, 83,  111, 229, 122,
    60,  211, 133, 230, 220, 105, 92,  41,  55,  46,  245, 40,  244, 102, 143, 54,  65,  25,  63,  161,
    1,   216, 80,  73,  209, 76,  132, 187, 208, 89,  18,  169, 200, 196, 135, 130, 116, 188, 159, 86,
    164, 100, 109, 198, 173, 186, 3,   64,  52,  217, 226, 250, 124, 123, 5,   202, 38,  147, 118, 126,
    255, 82,  85,  212, 207, 206, 59,  227, 47,  16,  58,  17,  182, 189, 28,  42,  223, 183, 170, 213,
    119, 248, 152, 2,   44,  154, 163, 70,  221, 153, 101, 155, 167, 43,  172, 9,   129, 22,  39,  253,
    19,  98,  108, 110, 79,  113, 224, 232, 178, 185, 112, 104, 218, 246, 97,  228, 251, 34,  242, 193,
    238, 210, 144, 12,  191, 179, 162, 241, 81,  51,  145, 235, 249, 14,  239, 107, 49,  192, 214, 31,
    181, 199, 106, 157, 184, 84,  204, 176, 115, 121, 50,  45,  127, 4,   150, 254, 138, 236, 205, 93,
    222, 114, 67,  29,  24,  72,  243, 141, 128, 195, 78,  66,  215, 61,  156, 180};

std::uint8_t order(int i) { return kOrder[i & 0xFF]; }

/// What differs between noise of bytes and of words: a number below 0 is one of Signed, one of a
/// cell's 256 (or 65536) places one of Place.
struct Bytes {
    using Signed = std::int8_t;
    using Place = std::uint8_t;
    static constexpr int kBits = 8;
    static Place ease(Place x) { return ease8InOutQuad(x); }
    static Place scale(Place x, Place by) { return scale8(x, by); }
    /// In one dimension the choice of the gradient is another one.
    static bool both_along(std::uint8_t hash) { return (hash & 8) != 0; }
    static bool along_first(std::uint8_t hash) { return (hash & 4) == 0; }
    /// In three dimensions: which direction is the first.
    static bool first_is_x(std::uint8_t hash) { return (hash & 8) == 0; }
    static bool first_is_x_of_two(std::uint8_t hash) { return (hash & 4) == 0; }
};
struct Words {
    using Signed = std::int16_t;
    using Place = std::uint16_t;
    static constexpr int kBits = 16;
    static Place ease(Place x) { return ease16InOutQuad(x); }
    static Place scale(Place x, Place by) { return scale16(x, by); }
    static bool both_along(std::uint8_t hash) { return (hash & 15) > 8; }
    static bool along_first(std::uint8_t hash) { return (hash & 15) < 4; }
    static bool first_is_x(std::uint8_t hash) { return (hash & 15) < 8; }
    static bool first_is_x_of_two(std::uint8_t hash) { return (hash & 7) < 4; }
};

template <typename Width>
class Noise {
    using Signed = typename Width::Signed;
    using Place = typename Width::Place;
    // Between two lattice points, as Signed counts.
    static constexpr int kCell = 1 << (Width::kBits - 1);

    /// One place: the cell, and where in it.
    struct Axis {
        explicit Axis(std::uint32_t at)
            : cell(static_cast<std::uint8_t>(at >> Width::kBits)),
              within(static_cast<Signed>(static_cast<Place>(at) >> 1)),
              eased(Width::ease(static_cast<Place>(at))) {}
        /// From the cell's beginning, or from its end.
        [[nodiscard]] Signed from(int corner) const { return static_cast<Signed>(within - corner * kCell); }
        std::uint8_t cell;
        Signed within;
        Place eased;
    };

    /// The mean of both, either with its sign changed as the hash says.
    static Signed gradient(std::uint8_t hash, Signed u, Signed v) {
        if ((hash & 1) != 0) u = static_cast<Signed>(-u);
        if ((hash & 2) != 0) v = static_cast<Signed>(-v);
        return static_cast<Signed>(avg15(u, v));
    }
    static Signed between(Signed a, Signed b, Place part) {
        const int way = Width::scale(static_cast<Place>(b > a ? b - a : a - b), part);
        return static_cast<Signed>(b > a ? a + way : a - way);
    }

  public:
    static Signed at(std::uint32_t x_at) {
        const Axis x(x_at);
        const auto corner = [&x](int i) {
            const std::uint8_t hash = order(order(order(x.cell + i)));
            const Signed along = x.from(i);
            if (Width::both_along(hash)) return gradient(hash, along, along);
            return Width::along_first(hash) ? gradient(hash, along, 1) : gradient(hash, 1, along);
        };
        return between(corner(0), corner(1), x.eased);
    }

    static Signed at(std::uint32_t x_at, std::uint32_t y_at) {
        const Axis x(x_at), y(y_at);
        const auto corner = [&x, &y](int i, int j) {
            const std::uint8_t hash = order(static_cast<std::uint8_t>(order(x.cell + i) + y.cell) + j);
            const std::uint8_t chosen = order(hash);
            const Signed u = x.from(i), v = y.from(j);
            return Width::first_is_x_of_two(chosen) ? gradient(chosen, u, v) : gradient(chosen, v, u);
        };
        const auto row = [&](int j) { return between(corner(0, j), corner(1, j), x.eased); };
        return between(row(0), row(1), y.eased);
    }

    static Signed at(std::uint32_t x_at, std::uint32_t y_at, std::uint32_t z_at) {
        const Axis x(x_at), y(y_at), z(z_at);
        const auto corner = [&x, &y, &z](int i, int j, int k) {
            const int in_row = static_cast<std::uint8_t>(order(x.cell + i) + y.cell) + j;
            const int in_layer = static_cast<std::uint8_t>(order(in_row) + z.cell) + k;
            const auto hash = static_cast<std::uint8_t>(order(in_layer) & 15);
            const Signed dx = x.from(i), dy = y.from(j), dz = z.from(k);
            const Signed u = Width::first_is_x(hash) ? dx : dy;
            const Signed v = hash < 4 ? dy : (hash == 12 || hash == 14 ? dx : dz);
            return gradient(hash, u, v);
        };
        const auto row = [&](int j, int k) { return between(corner(0, j, k), corner(1, j, k), x.eased); };
        const auto layer = [&](int k) { return between(row(0, k), row(1, k), y.eased); };
        return between(layer(0), layer(1), z.eased);
    }
};

std::uint8_t stretched(std::int8_t noise) {
    const auto above = static_cast<std::uint8_t>(noise + 64);
    return qadd8(above, above);
}

}  // namespace

std::int8_t inoise8_raw(std::uint16_t x, std::uint16_t y, std::uint16_t z) {
    return Noise<Bytes>::at(x, y, z);
}
std::int8_t inoise8_raw(std::uint16_t x, std::uint16_t y) { return Noise<Bytes>::at(x, y); }
std::int8_t inoise8_raw(std::uint16_t x) { return Noise<Bytes>::at(x); }
std::uint8_t inoise8(std::uint16_t x, std::uint16_t y, std::uint16_t z) {
    return stretched(inoise8_raw(x, y, z));
}
std::uint8_t inoise8(std::uint16_t x, std::uint16_t y) { return stretched(inoise8_raw(x, y)); }
std::uint8_t inoise8(std::uint16_t x) { return stretched(inoise8_raw(x)); }

std::int16_t inoise16_raw(std::uint32_t x, std::uint32_t y, std::uint32_t z) {
    return Noise<Words>::at(x, y, z);
}
std::int16_t inoise16_raw(std::uint32_t x, std::uint32_t y) { return Noise<Words>::at(x, y); }
std::int16_t inoise16_raw(std::uint32_t x) { return Noise<Words>::at(x); }

// The raw noise has another range in each number of dimensions, and FastLED stretches each to a
// word.
std::uint16_t inoise16(std::uint32_t x, std::uint32_t y, std::uint32_t z) {
    return static_cast<std::uint16_t>(static_cast<std::uint32_t>(inoise16_raw(x, y, z) + 19052) * 440u >> 8);
}
std::uint16_t inoise16(std::uint32_t x, std::uint32_t y) {
    return static_cast<std::uint16_t>(static_cast<std::uint32_t>(inoise16_raw(x, y) + 17308) * 484u >> 8);
}
std::uint16_t inoise16(std::uint32_t x) {
    return static_cast<std::uint16_t>(static_cast<std::uint32_t>(inoise16_raw(x) + 17308) << 1);
}

void fill_raw_noise8(std::uint8_t* data, std::uint8_t count, std::uint8_t octaves, std::uint16_t x, int step,
                     std::uint16_t time) {
    for (unsigned octave = 0; octave < octaves; ++octave) {
        for (unsigned i = 0; i < count; ++i) {
            const auto at = static_cast<std::uint16_t>((x + i * static_cast<unsigned>(step)) << octave);
            data[i] = qadd8(data[i], static_cast<std::uint8_t>(inoise8(at, time) >> octave));
        }
    }
}

void fill_raw_noise16into8(std::uint8_t* data, std::uint8_t count, std::uint8_t octaves, std::uint32_t x,
                           int step, std::uint32_t time) {
    for (unsigned octave = 0; octave < octaves; ++octave) {
        for (unsigned i = 0; i < count; ++i) {
            const std::uint32_t at = (x + i * static_cast<unsigned>(step)) << octave;
            const unsigned sum = (inoise16(at, time) >> octave) + data[i] * 256u;
            data[i] = static_cast<std::uint8_t>(std::min(sum, 65535u) >> 8);
        }
    }
}

namespace {

/// Each run of at most 255 pixels: `levels` and `hues` fill the bytes of one.
template <typename Levels, typename Hues>
void fill_by_noise(CRGB* pixels, int count, Levels levels, Hues hues, std::uint8_t hue_shift) {
    for (int begin = 0; begin < count; begin += 255) {
        const auto size = static_cast<std::uint8_t>(std::min(255, count - begin));
        std::array<std::uint8_t, 255> level{}, hue{};
        levels(level.data(), size);
        hues(hue.data(), size);
        for (std::size_t i = 0; i < size; ++i) {
            pixels[static_cast<std::size_t>(begin) + i] = CHSV(add8(hue[i], hue_shift), 255, level[i]);
        }
    }
}

}  // namespace

void fill_noise8(CRGB* pixels, int count, std::uint8_t octaves, std::uint16_t x, int step,
                 std::uint8_t hue_octaves, std::uint16_t hue_x, int hue_step, std::uint16_t time) {
    fill_by_noise(
        pixels, count,
        [&](std::uint8_t* to, std::uint8_t size) { fill_raw_noise8(to, size, octaves, x, step, time); },
        [&](std::uint8_t* to, std::uint8_t size) {
            fill_raw_noise8(to, size, hue_octaves, hue_x, hue_step, time);
        },
        0);
}

void fill_noise16(CRGB* pixels, int count, std::uint8_t octaves, std::uint16_t x, int step,
                  std::uint8_t hue_octaves, std::uint16_t hue_x, int hue_step, std::uint16_t time,
                  std::uint8_t hue_shift) {
    fill_by_noise(
        pixels, count,
        [&](std::uint8_t* to, std::uint8_t size) { fill_raw_noise16into8(to, size, octaves, x, step, time); },
        [&](std::uint8_t* to, std::uint8_t size) {
            fill_raw_noise8(to, size, hue_octaves, hue_x, hue_step, time);
        },
        hue_shift);
}
