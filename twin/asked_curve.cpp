#include "twin/asked_curve.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace qduino::twin {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;
constexpr double kSameAngle = 1e-9;
/// Half of the last decimal that files have: less, on either axis, is rounding, and no arc.
constexpr double kRoundingMm = 0.000'5;
constexpr int kChordsMax = 1'000'000;

struct PlaneAxes {
    std::size_t a, b;
    char a_word, b_word;
};
constexpr PlaneAxes kPlanes[]{{0, 1, 'I', 'J'}, {2, 0, 'K', 'I'}, {1, 2, 'J', 'K'}};

int chords_of(double length_in_chords) {
    return std::clamp(static_cast<int>(std::ceil(length_in_chords)), 1, kChordsMax);
}

}  // namespace

// I J K: the centre relative to the start. R: of the two arcs with that radius, the shorter (R > 0)
// or the longer (R < 0); its centre lies on the chord's bisector, at sqrt(R² − (chord/2)²) from the
// middle.
AskedCurve::Offset AskedCurve::centre_of(const CommandLine& command, double unit_mm) const {
    const double da = to_[a_] - from_[a_];
    const double db = to_[b_] - from_[b_];
    const bool clockwise = command.number == 2;
    if (command.has('R')) {
        const double radius = command.value('R') * unit_mm;
        const double chord = std::hypot(da, db);
        if (chord < kRoundingMm) return {from_[a_], from_[b_]};  // no circle is meant
        const double rise = std::sqrt(std::max(radius * radius - chord * chord / 4, 0.0));
        const double side = clockwise == (radius > 0) ? -1.0 : 1.0;  // left of the chord is +1
        return {from_[a_] + da / 2 - side * rise * db / chord, from_[b_] + db / 2 + side * rise * da / chord};
    }
    const PlaneAxes& words = kPlanes[a_ == 0 ? 0 : a_ == 2 ? 1 : 2];
    return {from_[a_] + command.value(words.a_word) * unit_mm,
            from_[b_] + command.value(words.b_word) * unit_mm};
}

void AskedCurve::begin_arc(const CommandLine& command, Plane plane, double unit_mm, const Position& from,
                           const Position& to) {
    *this = AskedCurve{};
    a_ = kPlanes[static_cast<std::size_t>(plane)].a;
    b_ = kPlanes[static_cast<std::size_t>(plane)].b;
    from_ = from;
    to_ = to;
    chords_ = 1;
    centre_ = centre_of(command, unit_mm);
    radius_from_ = std::hypot(from[a_] - centre_.a, from[b_] - centre_.b);
    radius_to_ = std::hypot(to[a_] - centre_.a, to[b_] - centre_.b);
    if (radius_from_ == 0) return;
    start_angle_ = std::atan2(from[b_] - centre_.b, from[a_] - centre_.a);
    const bool clockwise = command.number == 2;
    const int turns = static_cast<int>(command.value('P'));
    sweep_to(std::atan2(to[b_] - centre_.b, to[a_] - centre_.a), clockwise, turns);
    // A chord over angle φ leaves its arc by r (1 − cos φ/2), about r φ²/8.
    const double angle = std::sqrt(8 * kChordErrorMm / std::max(radius_from_, radius_to_));
    chords_ = chords_of(std::abs(sweep_) / angle);
}

void AskedCurve::sweep_to(double end_angle, bool clockwise, int turns) {
    const double way = clockwise ? -1.0 : 1.0;
    double sweep = way * (end_angle - start_angle_);
    if (sweep < -kSameAngle) sweep += kTurn;
    if (std::abs(sweep) < kSameAngle || std::abs(sweep - kTurn) < kSameAngle) sweep = 0;
    const bool whole = std::max(std::abs(to_[a_] - from_[a_]), std::abs(to_[b_] - from_[b_])) <= kRoundingMm;
    if (whole) sweep = 0;
    if (whole && turns == 0) sweep = kTurn;  // back to the start: a whole turn
    sweep_ = way * (sweep + kTurn * turns);
}

// The second difference of the control points bounds the curve's bend: |B''| ≤ 6 M, and a chord
// over 1/n of the parameter leaves the curve by 6 M / (8 n²) at most.
void AskedCurve::begin_spline(const CommandLine& command, double unit_mm, const Position& from,
                              const Position& to) {
    *this = AskedCurve{};
    is_spline_ = true;
    from_ = from;
    to_ = to;
    controls_[0] = {from[0] + command.value('I') * unit_mm, from[1] + command.value('J') * unit_mm};
    controls_[1] = {to[0] + command.value('P') * unit_mm, to[1] + command.value('Q') * unit_mm};
    const auto bend = [](double p, double q, double r) { return p - 2 * q + r; };
    const double first = std::hypot(bend(from[0], controls_[0].a, controls_[1].a),
                                    bend(from[1], controls_[0].b, controls_[1].b));
    const double second =
        std::hypot(bend(controls_[0].a, controls_[1].a, to[0]), bend(controls_[0].b, controls_[1].b, to[1]));
    chords_ = chords_of(std::sqrt(0.75 * std::max(first, second) / kChordErrorMm));
}

Position AskedCurve::next() {
    ++chord_;
    if (chord_ >= chords_) return to_;
    const double share = static_cast<double>(chord_) / chords_;
    return is_spline_ ? spline_at(share) : arc_at(share);
}

Position AskedCurve::arc_at(double share) const {
    Position point;
    for (std::size_t axis = 0; axis < kAxisCount; ++axis)
        point[axis] = from_[axis] + share * (to_[axis] - from_[axis]);
    const double angle = start_angle_ + share * sweep_;
    const double radius = radius_from_ + share * (radius_to_ - radius_from_);
    point[a_] = centre_.a + radius * std::cos(angle);
    point[b_] = centre_.b + radius * std::sin(angle);
    return point;
}

// De Casteljau: the curve's point by repeated halving of nothing but its control points.
Position AskedCurve::spline_at(double share) const {
    Position point;
    for (std::size_t axis = 0; axis < kAxisCount; ++axis)
        point[axis] = from_[axis] + share * (to_[axis] - from_[axis]);
    const auto between = [share](double p, double q) { return p + share * (q - p); };
    const auto point_of = [&](double p0, double p1, double p2, double p3) {
        const double q0 = between(p0, p1), q1 = between(p1, p2), q2 = between(p2, p3);
        return between(between(q0, q1), between(q1, q2));
    };
    point[0] = point_of(from_[0], controls_[0].a, controls_[1].a, to_[0]);
    point[1] = point_of(from_[1], controls_[0].b, controls_[1].b, to_[1]);
    return point;
}

}  // namespace qduino::twin
