// A curve that the file asks for: an arc (G2, G3) in one of the three planes, or a cubic Bézier
// spline (G5), as chords so fine that they are the curve itself for every motor.
//
//   G17  first axis X, second Y, centre I J        G5   P0 = start, P1 = P0 + (I, J)
//   G18  first axis Z, second X, centre K I             P3 = end,   P2 = P3 + (P, Q)
//   G19  first axis Y, second Z, centre J K             Z and E advance evenly with the parameter
//
// The axes of each plane are in the right-handed order, so G3 turns from the first to the second.
// The other axes advance evenly with the angle. Ends that are not equally far from the centre: the
// radius goes evenly from one to the other. Ends in the same direction from it, and at different
// distances: nothing turns, the way is straight.
//
// Sources: RS274/NGC (NIST, Kramer et al. 2000), section 3.5.3, for planes and centres; Marlin 2.1,
// G005, for the spline. The firmware's own arcs (printer/gcode) share nothing with this file.
#pragma once

#include <array>
#include <cstddef>

#include "twin/line_reader.h"
#include "twin/machine.h"

namespace qduino::twin {

enum class Plane : std::uint8_t { xy, zx, yz };  ///< G17, G18, G19

class AskedCurve {
  public:
    /// A chord leaves its curve by no more.
    static constexpr double kChordErrorMm = 0.0002;

    /// The curve of a G2, G3 or G5. Lengths of `command` are in units of `unit_mm`.
    void begin_arc(const CommandLine& command, Plane plane, double unit_mm, const Position& from,
                   const Position& to);
    void begin_spline(const CommandLine& command, double unit_mm, const Position& from, const Position& to);

    [[nodiscard]] bool active() const { return chord_ < chords_; }
    /// The end of the next chord; the last ends exactly where the command says. Contract: active().
    [[nodiscard]] Position next();

  private:
    struct Offset {
        double a = 0, b = 0;
    };

    [[nodiscard]] Offset centre_of(const CommandLine& command, double unit_mm) const;
    void sweep_to(double end_angle, bool clockwise, int turns);
    [[nodiscard]] Position arc_at(double share) const;
    [[nodiscard]] Position spline_at(double share) const;

    bool is_spline_ = false;
    std::size_t a_ = 0, b_ = 1;  // the axes of the plane
    Offset centre_{};
    double radius_from_ = 0, radius_to_ = 0, start_angle_ = 0, sweep_ = 0;
    std::array<Offset, 2> controls_{};
    Position from_{}, to_{};
    int chord_ = 0, chords_ = 0;
};

}  // namespace qduino::twin
