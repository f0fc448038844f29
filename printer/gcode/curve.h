// The progress along a curve, an arc or a spline, of a caller that takes it chord by chord.
#pragma once

#include <cstdint>
#include <variant>

#include "printer/gcode/arc.h"
#include "printer/gcode/spline.h"

namespace qduino::printer::gcode {

class Curve {
  public:
    explicit Curve(const ArcPath& path) : path_(path) {}
    explicit Curve(const SplinePath& path) : path_(path) {}

    [[nodiscard]] std::uint32_t chords() const {
        return std::visit([](const auto& path) { return path.chords(); }, path_);
    }
    /// End of chord `index` (0 … chords() − 1); the last is exactly the curve's end.
    [[nodiscard]] Position point(std::uint32_t index) const {
        return std::visit([=](const auto& path) { return path.point(index); }, path_);
    }
    [[nodiscard]] const Position& end() const {
        return std::visit([](const auto& path) -> const Position& { return path.end(); }, path_);
    }
    [[nodiscard]] bool done() const { return next_ == chords(); }
    /// The end of the next chord. Contract: !done().
    [[nodiscard]] Position peek() const { return point(next_); }
    void advance() { ++next_; }

  private:
    std::variant<ArcPath, SplinePath> path_;
    std::uint32_t next_ = 0;
};

}  // namespace qduino::printer::gcode
