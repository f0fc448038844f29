// Writes SVG (Scalable Vector Graphics 1.1, W3C): shapes by class, in points of a page. Every text
// is escaped, so a name may hold anything.
#pragma once

#include <string>
#include <string_view>

#include "base/text.h"

namespace qduino::apps::picture {

/// `text` as XML takes it between tags and in attributes: the five characters that mean something
/// are spelled out, control characters and bytes that are no UTF-8 become '?'.
[[nodiscard]] std::string escaped(std::string_view text);

/// At most `most` characters of UTF-8; a longer text ends in "…".
[[nodiscard]] std::string shortened(std::string_view text, std::size_t most);

class Svg {
  public:
    /// Begins a page of this size. `style` is a style sheet, `definitions` what shapes refer to,
    /// and `attributes` are further ones of the root: all three as they stand.
    Svg(int width, int height, std::string_view style, std::string_view definitions,
        std::string_view attributes);

    void rectangle(std::string_view kind, double x, double y, double width, double height,
                   std::string_view title = "");
    void line(std::string_view kind, double x1, double y1, double x2, double y2);
    /// `d`: path data, as move() and so on below write it.
    void path(std::string_view kind, std::string_view d, std::string_view title = "");
    /// A picture of pixels; `address`: a data: URL, as it stands.
    void image(double x, double y, double width, double height, std::string_view address);
    /// `kind` holds the anchor, too: "end", "middle".
    void words(std::string_view kind, double x, double y, std::string_view text);
    void begin_group(std::string_view kind, std::string_view attributes = "", std::string_view title = "");
    void end_group() { out_ += "</g>\n"; }
    /// The whole text. Nothing may follow.
    [[nodiscard]] std::string finish();

    /// Two decimals: a hundredth of a point is less than anybody sees.
    [[nodiscard]] static Fixed point(double value) { return {value, 2}; }

  private:
    void shape_end(std::string_view element, std::string_view title);
    std::string out_;
};

}  // namespace qduino::apps::picture
