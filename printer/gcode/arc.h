// Arcs (G2, G3) as chains of chords, none further than `kArcToleranceMm` from the true curve.
//
//          __--B--__         A chord over the angle θ of a circle of radius r misses it by
//       A-´    |s   `-C          s = r·(1 − cos θ/2),  so  θ = 2·acos(1 − s/r),
//        \`----+----´/       and an arc of sweep φ takes ⌈|φ|/θ⌉ chords.
//         \    |θ   /
//          \   |r  /         Z and E advance evenly with the angle: a helix.
//           \  |  /
//            centre
//
// Where the two ends are not at quite the same distance from the centre (a slicer's rounding), the
// radius goes evenly from one to the other, so that the path ends exactly where the command says.
#pragma once

#include <cstdint>

#include "base/result.h"
#include "printer/gcode/position.h"

namespace qduino::printer::gcode {

inline constexpr double kArcToleranceMm = 0.005;
/// The ends may differ this much in their distance from the centre; three decimals of a slicer give
/// 0.002.
inline constexpr double kArcRadiusMismatchMm = 0.05;
inline constexpr double kArcRadiusMaxMm = 100'000;
inline constexpr std::uint32_t kArcTurnsMax = 20;

/// Seen from above, G2 and G3.
enum class ArcDirection : std::uint8_t { clockwise, counterclockwise };

/// An arc in the XY plane, before its ends are known.
struct ArcGeometry {
    ArcDirection direction = ArcDirection::clockwise;
    bool by_radius = false;
    double centre_dx_mm = 0;  ///< I, J: the centre, from the start
    double centre_dy_mm = 0;
    double radius_mm = 0;  ///< R: below 0 means the longer of the two arcs
    /// P: whole turns on top of the arc; a whole circle makes this many in all.
    std::uint32_t turns = 0;
};

/// The points of one arc, one by one. A small value; no memory but this.
class ArcPath {
  public:
    /// Error: no such arc (no centre, no radius, ends that do not lie on one circle, radius above
    /// kArcRadiusMaxMm).
    static Result<ArcPath> make(const Position& from, const Position& to, const ArcGeometry& geometry);

    [[nodiscard]] std::uint32_t chords() const { return chords_; }
    /// End of chord `index` (0 … chords() − 1); the last is exactly the arc's end.
    [[nodiscard]] Position point(std::uint32_t index) const;

    // The progress of a caller that walks along it.
    [[nodiscard]] const Position& end() const { return to_; }
    [[nodiscard]] bool done() const { return next_ == chords_; }
    /// The end of the next chord. Contract: !done().
    [[nodiscard]] Position peek() const { return point(next_); }
    void advance() { ++next_; }

  private:
    Position from_;
    Position to_;
    double centre_x_mm_ = 0;
    double centre_y_mm_ = 0;
    double radius_from_mm_ = 0;
    double radius_to_mm_ = 0;
    double angle_from_ = 0;
    double sweep_ = 0;  ///< radians, counterclockwise above 0
    std::uint32_t chords_ = 1;
    std::uint32_t next_ = 0;
};

}  // namespace qduino::printer::gcode
