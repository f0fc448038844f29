// Arcs (G2, G3) as chains of chords, none further than `kArcToleranceMm` from the true curve.
//
//          __--B--__         A chord over the angle θ of a circle of radius r misses it by
//       A-´    |s   `-C          s = r·(1 − cos θ/2),  so  θ = 2·acos(1 − s/r),
//        \`----+----´/       and an arc of sweep φ takes ⌈|φ|/θ⌉ chords.
//         \    |θ   /
//          \   |r  /         The other axes advance evenly with the angle: a helix.
//           \  |  /
//            centre
//
// The plane's axes stand in the right-handed order, so G3 turns from the first to the second
// (RS274/NGC, NIST, section 3.5.3; Marlin 2.1, G017-G019):
//
//   G17  X Y, centre I J      G18  Z X, centre K I      G19  Y Z, centre J K
//
// Where the two ends are not at quite the same distance from the centre (a slicer's rounding), the
// radius goes evenly from one to the other, so that the path ends exactly where the command says.
// Ends that lie in the same direction from the centre leave nothing to turn: the way is straight,
// as far as the ends may be apart (Klipper goes straight, too).
#pragma once

#include <cstdint>

#include "base/result.h"
#include "printer/gcode/position.h"

namespace qduino::printer::gcode {

inline constexpr double kArcToleranceMm = 0.005;
/// The ends may differ this much in their distance from the centre; three decimals of a slicer give
/// 0.002.
inline constexpr double kArcRadiusMismatchMm = 0.05;
/// Ends that are no further apart on either axis are one point: half of the third decimal, which is
/// what a file's rounding makes of a place that was reached in other steps, behind a G92 or in
/// inches. No file means an arc that short. RS274/NGC (section 3.5.3) takes the same numbers as the
/// same point; Marlin's limit is 1e-6 mm (its G2 and G3, NEAR), grbl's 5e-7 radians.
inline constexpr double kSamePlaceMm = 0.000'5;
inline constexpr double kArcRadiusMaxMm = 100'000;
inline constexpr std::uint32_t kArcTurnsMax = 20;

/// Seen from the positive end of the third axis, G2 and G3.
enum class ArcDirection : std::uint8_t { clockwise, counterclockwise };

/// G17, G18, G19.
enum class ArcPlane : std::uint8_t { xy, zx, yz };

/// The axes of a plane, in order.
struct PlaneAxes {
    Axis first = Axis::x;
    Axis second = Axis::y;
};
constexpr PlaneAxes axes_of(ArcPlane plane) {
    constexpr PlaneAxes kAxes[]{{Axis::x, Axis::y}, {Axis::z, Axis::x}, {Axis::y, Axis::z}};
    return kAxes[static_cast<std::size_t>(plane)];
}

/// An arc, before its ends are known.
struct ArcGeometry {
    ArcDirection direction = ArcDirection::clockwise;
    ArcPlane plane = ArcPlane::xy;
    bool by_radius = false;
    double centre_first_mm = 0;  ///< the centre, from the start, along the plane's axes
    double centre_second_mm = 0;
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
    [[nodiscard]] const Position& end() const { return to_; }

  private:
    Position from_;
    Position to_;
    PlaneAxes axes_;
    double centre_first_mm_ = 0;
    double centre_second_mm_ = 0;
    double radius_from_mm_ = 0;
    double radius_to_mm_ = 0;
    double angle_from_ = 0;
    double sweep_ = 0;  ///< radians, counterclockwise above 0
    std::uint32_t chords_ = 1;
};

}  // namespace qduino::printer::gcode
