// The built part as pixels, each stretch of line in the colour of its error of height.
//
//   view from above            view from the front, the left and above
//   ┌────────┐ y               ╱╲
//   │ ══════ │ ↑              ╱══╲     a near line covers a far one
//   └────────┘ → x           ╲══╱
//
// The colours are two of M. Okabe and K. Ito, "Color Universal Design" (2008), which colour-blind
// people can tell apart, and a grey between them: blue is too thin, vermilion too thick. How bright
// a line is depends on its direction, so that walls and infill look like bodies.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "report/picture/raster.h"
#include "twin/height_map.h"

namespace qduino::apps {

/// From here on an error has the strongest colour.
inline constexpr double kWorstShown = 0.2;

enum class ViewFrom : std::uint8_t { above, corner };

class PartView {
  public:
    /// Fits the cells into `width` × `height` pixels. `line_mm`: how wide a line is drawn.
    PartView(std::span<const twin::HeightCell> cells, ViewFrom from, int width, int height, double line_mm);

    /// Where a place of the part is on the picture, in pixels; also if it is covered.
    [[nodiscard]] picture::Spot spot(double x_mm, double y_mm, double z_mm) const;
    [[nodiscard]] std::string png() const;

  private:
    [[nodiscard]] picture::Spot turned(double x_mm, double y_mm, double z_mm) const;
    void fit(std::span<const twin::HeightCell> cells);
    void draw(const twin::HeightCell& from, const twin::HeightCell& to);

    ViewFrom from_;
    double line_mm_;
    double scale_ = 1;
    double left_ = 0, top_ = 0;  // of the picture, turned and scaled
    picture::Raster raster_;
};

/// The colour of an error of height, as a share of the height asked for.
[[nodiscard]] picture::Colour colour_of(double error);

/// The cells of layer `layer`, from 1: those at the layer-th height from below. Empty: there is no
/// such layer.
[[nodiscard]] std::vector<twin::HeightCell> cells_of_layer(std::span<const twin::HeightCell> cells,
                                                           std::size_t layer);

}  // namespace qduino::apps
