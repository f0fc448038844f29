#include "apps/printer_sim/part_view.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>

namespace qduino::apps {
namespace {

using picture::Colour;
using picture::Spot;
using twin::HeightCell;

// The palette: kErrors colours from thin to thick in kShades of brightness each, from number 1 on.
constexpr int kErrors = 21, kShades = 12;

// The corner view: turned so far about Z, and seen so far from above.
constexpr double kTurn = -0.6, kTilt = 0.6;
// The margin on each side of the part, as a share of the picture.
constexpr double kMargin = 0.03;

constexpr Colour kThin{0, 114, 178}, kRight{224, 221, 210}, kThick{213, 94, 0};

std::uint8_t blend(std::uint8_t from, std::uint8_t to, double share) {
    return static_cast<std::uint8_t>(std::lround(from + share * (to - from)));
}

std::uint8_t number_of(double error, double shade) {
    const double share = std::clamp(error / kWorstShown, -1.0, 1.0) / 2 + 0.5;
    const auto level = static_cast<int>(std::lround(share * (kErrors - 1)));
    const auto bright = std::clamp(static_cast<int>(shade * kShades), 0, kShades - 1);
    return static_cast<std::uint8_t>(1 + level * kShades + bright);
}

std::vector<Colour> palette() {
    std::vector<Colour> colours(1);
    for (int level = 0; level < kErrors; ++level) {
        const Colour full = colour_of(kWorstShown * (2.0 * level / (kErrors - 1) - 1));
        for (int shade = 0; shade < kShades; ++shade) {
            const double bright = 0.45 + 0.55 * shade / (kShades - 1);
            const auto dim = [&](std::uint8_t c) { return static_cast<std::uint8_t>(c * bright); };
            colours.push_back({dim(full.red), dim(full.green), dim(full.blue)});
        }
    }
    return colours;
}

}  // namespace

Colour colour_of(double error) {
    const double share = std::min(std::abs(error) / kWorstShown, 1.0);
    const Colour& end = error < 0 ? kThin : kThick;
    return {blend(kRight.red, end.red, share), blend(kRight.green, end.green, share),
            blend(kRight.blue, end.blue, share)};
}

std::vector<HeightCell> cells_of_layer(std::span<const HeightCell> cells, std::size_t layer) {
    // Heights that differ by less are one layer's: a head may be lifted by a microstep.
    constexpr double kSameMm = 0.02;
    const auto rounded = [&](float z) { return std::lround(static_cast<double>(z) / kSameMm); };
    std::set<long> heights;
    for (const HeightCell& cell : cells) heights.insert(rounded(cell.z_mm));
    std::vector<HeightCell> found;
    if (layer == 0 || layer > heights.size()) return found;
    const long wanted = *std::next(heights.begin(), static_cast<std::ptrdiff_t>(layer - 1));
    std::ranges::copy_if(cells, std::back_inserter(found),
                         [&](const HeightCell& cell) { return rounded(cell.z_mm) == wanted; });
    return found;
}

PartView::PartView(std::span<const HeightCell> cells, ViewFrom from, int width, int height, double line_mm)
    : from_(from), line_mm_(line_mm), raster_(width, height) {
    if (cells.empty()) return;
    fit(cells);
    for (std::size_t i = 1; i < cells.size(); ++i) {
        if (cells[i].joined) draw(cells[i - 1], cells[i]);
    }
}

std::string PartView::png() const { return raster_.png(palette()); }

// In mm, seen from there: to the right, down, and away.
Spot PartView::turned(double x_mm, double y_mm, double z_mm) const {
    if (from_ == ViewFrom::above)
        return {static_cast<float>(x_mm), static_cast<float>(-y_mm), static_cast<float>(-z_mm)};
    const double right = x_mm * std::cos(kTurn) - y_mm * std::sin(kTurn);
    const double away = x_mm * std::sin(kTurn) + y_mm * std::cos(kTurn);
    return {static_cast<float>(right), static_cast<float>(-z_mm * std::cos(kTilt) - away * std::sin(kTilt)),
            static_cast<float>(away * std::cos(kTilt) - z_mm * std::sin(kTilt))};
}

void PartView::fit(std::span<const HeightCell> cells) {
    constexpr float kFar = std::numeric_limits<float>::max();
    Spot low{kFar, kFar, 0}, high{-kFar, -kFar, 0};
    for (const HeightCell& cell : cells) {
        const Spot at = turned(cell.x_mm, cell.y_mm, cell.z_mm);
        low = {std::min(low.x, at.x), std::min(low.y, at.y), 0};
        high = {std::max(high.x, at.x), std::max(high.y, at.y), 0};
    }
    const double wide = static_cast<double>(high.x - low.x) + line_mm_;
    const double tall = static_cast<double>(high.y - low.y) + line_mm_;
    scale_ = (1 - 2 * kMargin) * std::min(raster_.width() / wide, raster_.height() / tall);
    left_ = (static_cast<double>(low.x + high.x) * scale_ - raster_.width()) / 2;
    top_ = (static_cast<double>(low.y + high.y) * scale_ - raster_.height()) / 2;
}

Spot PartView::spot(double x_mm, double y_mm, double z_mm) const {
    const Spot at = turned(x_mm, y_mm, z_mm);
    return {static_cast<float>(static_cast<double>(at.x) * scale_ - left_),
            static_cast<float>(static_cast<double>(at.y) * scale_ - top_), at.distance};
}

void PartView::draw(const HeightCell& from, const HeightCell& to) {
    const double dx = static_cast<double>(to.x_mm - from.x_mm), dy = static_cast<double>(to.y_mm - from.y_mm);
    const double length = std::hypot(dx, dy);
    // Light from the left: on a wall that goes away from it less falls.
    const double lit = length > 0 ? 0.55 + 0.45 * std::abs(dy * 0.94 - dx * 0.34) / length : 1;
    raster_.stroke(spot(from.x_mm, from.y_mm, from.z_mm), spot(to.x_mm, to.y_mm, to.z_mm),
                   static_cast<float>(line_mm_ * scale_), [&](float beside) {
                       return number_of(static_cast<double>(to.error),
                                        lit * (1 - 0.4 * static_cast<double>(beside)));
                   });
}

}  // namespace qduino::apps
