// How fast the corner between two moves may be taken.
//
//                 u2
//               ^
//      u1      /         θ: the angle of the corner, 180° for straight on
//   --------->'          s = sin(θ/2) = ½|u1 + u2|
//             θ          c = cos(θ/2) = ½|u1 − u2|
//
// Junction deviation (S. K. Jeon's, as in grbl and Klipper's toolhead): the corner is taken as if
// an arc were laid into it that leaves the path by δ: v² = a·δ·s/(1−s). With 1 − s = c²/(1+s) this
// is a·δ·s(1+s)/c², which does not cancel where moves are nearly in line. δ follows from the speed
// at which a square corner is to be taken: δ = scv²(√2−1)/a, with the acceleration that the move
// asked for. The a of the corner is the one that the axes allow.
//
// On curves made of short moves the arc must also fit in the moves: v² <= ½·L·a·s/c (centripetal;
// Klipper toolhead.py).
//
// Z and E have no useful angle (E is not in space at all, and Z is slow). For them the step of the
// axis' own speed is bounded: |v·(u2 − u1)| <= instantaneous speed.
#pragma once

#include "printer/motion/settings.h"

namespace qduino::printer::motion {

/// The numbers of a move that its corners depend on, per mm of its own length (along X, Y, Z, or
/// along E when nothing else moves).
struct MoveGeometry {
    AxisVector direction{};  ///< change of each axis per mm of length
    double length_mm = 0;
    double acceleration_mm_s2 = 0;  ///< what the axes allow
    double deviation_mm = 0;        ///< δ
    double speed_mm_s = 0;          ///< nominal: what the axes allow
    bool extrude_only = false;      ///< only E moves: the length is that of E
};

/// δ for a corner of 90° to be taken at `square_corner_speed_mm_s`.
constexpr double junction_deviation_mm(double square_corner_speed_mm_s, double acceleration_mm_s2) {
    return square_corner_speed_mm_s * square_corner_speed_mm_s * 0.41421356237309503 / acceleration_mm_s2;
}

/// Largest square of the speed (mm²/s²) at which `before` may end and `after` begin. 0 between an
/// E-only move and one in space: they have no common direction.
double junction_speed_squared(const MoveGeometry& before, const MoveGeometry& after,
                              const PerAxis<MillimetresPerSecond>& instantaneous_speed);

}  // namespace qduino::printer::motion
