// A picture of pixels that nearer things cover: for what has too many parts to be shapes of a page.
//
//   stroke() ──► each pixel: nearer than what is there? ──► number of a colour ──► PNG
//
// Each pixel is a number of the palette; 0 is nothing, which is transparent.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace qduino::apps::picture {

struct Colour {
    std::uint8_t red = 0, green = 0, blue = 0;
};

/// A place on the picture, in pixels from its upper left corner, and its distance from the eye.
struct Spot {
    float x = 0, y = 0, distance = 0;
};

class Raster {
  public:
    Raster(int width, int height);

    /// A line with round ends, `width` pixels wide (at least one). `colour(r)` gives the number of
    /// the palette, not 0: r is 0 in the middle of the line and 1 at its long edges, and grows with
    /// the square of the distance.
    template <typename ColourAt>
    void stroke(const Spot& from, const Spot& to, float width, ColourAt colour);

    [[nodiscard]] int width() const { return width_; }
    [[nodiscard]] int height() const { return height_; }
    /// 0: nothing is there, or it is outside.
    [[nodiscard]] std::uint8_t at(int x, int y) const;

    /// As a PNG. `palette`: at most 256 colours; that of number 0 is not shown. Empty: no memory.
    [[nodiscard]] std::string png(std::span<const Colour> palette) const;

  private:
    void put(int x, int y, float distance, std::uint8_t colour);

    int width_;
    int height_;
    std::vector<std::uint8_t> pixels_;
    std::vector<float> distances_;
};

/// As the address of a picture inside a page: `data:image/png;base64,…` (RFC 2397).
[[nodiscard]] std::string data_address(const std::string& png);

// ---- details of the template --------------------------------------------------------------------

template <typename ColourAt>
void Raster::stroke(const Spot& from, const Spot& to, float width, ColourAt colour) {
    const float radius = width > 1 ? width / 2 : 0.5f;
    const float dx = to.x - from.x, dy = to.y - from.y;
    const float length2 = dx * dx + dy * dy;
    const auto lowest = [&](float a, float b) { return static_cast<int>((a < b ? a : b) - radius); };
    const auto highest = [&](float a, float b) { return static_cast<int>((a > b ? a : b) + radius) + 1; };
    for (int y = lowest(from.y, to.y); y <= highest(from.y, to.y); ++y) {
        for (int x = lowest(from.x, to.x); x <= highest(from.x, to.x); ++x) {
            const float px = static_cast<float>(x) - from.x, py = static_cast<float>(y) - from.y;
            const float along = length2 > 0 ? (px * dx + py * dy) / length2 : 0;
            const float share = along < 0 ? 0 : along > 1 ? 1 : along;
            const float bx = px - share * dx, by = py - share * dy;
            if (bx * bx + by * by > radius * radius) continue;
            const float cross = length2 > 0 ? (px * dy - py * dx) * (px * dy - py * dx) / length2 : 0;
            put(x, y, from.distance + share * (to.distance - from.distance),
                colour(cross / (radius * radius)));
        }
    }
}

}  // namespace qduino::apps::picture
