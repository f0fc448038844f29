#include "printer/gcode/arc.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace qduino::printer::gcode::arc_test {
namespace {

constexpr double kPi = std::numbers::pi;

Position at(double x, double y, double z = 0, double e = 0) {
    return Position{{Millimetres{x}, Millimetres{y}, Millimetres{z}, Millimetres{e}}};
}

ArcGeometry around(ArcDirection direction, double i, double j, std::uint32_t turns = 0) {
    ArcGeometry g;
    g.direction = direction;
    g.centre_first_mm = i;
    g.centre_second_mm = j;
    g.turns = turns;
    return g;
}

ArcGeometry with_radius(ArcDirection direction, double radius) {
    ArcGeometry g;
    g.direction = direction;
    g.by_radius = true;
    g.radius_mm = radius;
    return g;
}

struct Measured {
    double length_mm = 0;
    double chord_error_mm_max = 0;  ///< of chord middles, from the circle
    double vertex_error_mm_max = 0;
    double middle_x_mm = 0;  ///< of the whole path, half way by index
    double middle_y_mm = 0;
};

Measured measure(const ArcPath& arc, const Position& from, double centre_x, double centre_y, double radius) {
    Measured m;
    Position last = from;
    for (std::uint32_t i = 0; i < arc.chords(); ++i) {
        const Position next = arc.point(i);
        const double x0 = last[Axis::x].value() - centre_x;
        const double y0 = last[Axis::y].value() - centre_y;
        const double x1 = next[Axis::x].value() - centre_x;
        const double y1 = next[Axis::y].value() - centre_y;
        m.length_mm += std::hypot(x1 - x0, y1 - y0);
        m.vertex_error_mm_max = std::max(m.vertex_error_mm_max, std::abs(std::hypot(x1, y1) - radius));
        const double middle = std::hypot((x0 + x1) / 2, (y0 + y1) / 2);
        m.chord_error_mm_max = std::max(m.chord_error_mm_max, radius - middle);
        if (i == arc.chords() / 2) {
            m.middle_x_mm = next[Axis::x].value();
            m.middle_y_mm = next[Axis::y].value();
        }
        last = next;
    }
    return m;
}

TEST(Arc, LengthDirectionAndError) {
    struct Case {
        const char* name;
        Position from, to;
        ArcGeometry geometry;
        double centre_x, centre_y, radius, sweep;
    };
    const auto cw = ArcDirection::clockwise;
    const auto ccw = ArcDirection::counterclockwise;
    const Case cases[] = {
        {"quarter, counterclockwise", at(10, 0), at(0, 10), around(ccw, -10, 0), 0, 0, 10, kPi / 2},
        {"three quarters, clockwise", at(10, 0), at(0, 10), around(cw, -10, 0), 0, 0, 10, 3 * kPi / 2},
        {"half", at(10, 10), at(30, 10), around(cw, 10, 0), 20, 10, 10, kPi},
        {"whole circle", at(10, 0), at(10, 0), around(ccw, 10, 0), 20, 0, 10, 2 * kPi},
        {"two whole circles", at(10, 0), at(10, 0), around(ccw, 10, 0, 2), 20, 0, 10, 4 * kPi},
        {"a turn on top of a quarter", at(10, 0), at(0, 10), around(ccw, -10, 0, 1), 0, 0, 10, 2.5 * kPi},
        {"short by radius", at(10, 0), at(0, 10), with_radius(ccw, 10), 0, 0, 10, kPi / 2},
        {"long by radius", at(10, 0), at(0, 10), with_radius(ccw, -10), 10, 10, 10, 3 * kPi / 2},
        {"short by radius, clockwise", at(10, 0), at(0, 10), with_radius(cw, 10), 10, 10, 10, kPi / 2},
        {"half by radius", at(0, 0), at(20, 0), with_radius(cw, 10), 10, 0, 10, kPi},
        {"tiny", at(0, 0), at(0.01, 0), around(cw, 0.005, 0), 0.005, 0, 0.005, kPi},
    };
    for (const Case& c : cases) {
        const auto arc = ArcPath::make(c.from, c.to, c.geometry);
        ASSERT_TRUE(arc.ok()) << c.name << ": " << arc.error().message.view();
        const Measured m = measure(*arc, c.from, c.centre_x, c.centre_y, c.radius);
        EXPECT_LE(m.chord_error_mm_max, kArcToleranceMm * (1 + 1e-9)) << c.name;
        EXPECT_LE(m.vertex_error_mm_max, 1e-9) << c.name;
        // An inscribed chain of n chords over sweep φ has length 2·r·n·sin(φ/2n).
        const double n = arc->chords();
        EXPECT_NEAR(m.length_mm, 2 * c.radius * n * std::sin(c.sweep / 2 / n), 1e-9) << c.name;
        EXPECT_EQ(arc->point(arc->chords() - 1), c.to) << c.name;
    }
}

TEST(Arc, ClockwiseAndCounterclockwiseGoOppositeWays) {
    const auto above = ArcPath::make(at(10, 10), at(30, 10), around(ArcDirection::clockwise, 10, 0));
    const auto below = ArcPath::make(at(10, 10), at(30, 10), around(ArcDirection::counterclockwise, 10, 0));
    EXPECT_GT(measure(*above, at(10, 10), 20, 10, 10).middle_y_mm, 19);
    EXPECT_LT(measure(*below, at(10, 10), 20, 10, 10).middle_y_mm, 1);
}

TEST(Arc, NoMoreChordsThanTheToleranceAsksFor) {
    const auto arc = ArcPath::make(at(10, 0), at(10, 0), around(ArcDirection::clockwise, 10, 0));
    const double step = 2 * std::acos(1 - kArcToleranceMm / 10);
    EXPECT_EQ(arc->chords(), static_cast<std::uint32_t>(std::ceil(2 * kPi / step)));
}

TEST(Arc, HeightAndFilamentGoEvenly) {
    const auto arc =
        ArcPath::make(at(10, 0, 1, 5), at(0, 10, 2, 6), around(ArcDirection::counterclockwise, -10, 0));
    ASSERT_TRUE(arc.ok());
    for (std::uint32_t i = 0; i < arc->chords(); ++i) {
        const double along = static_cast<double>(i + 1) / arc->chords();
        EXPECT_NEAR(arc->point(i)[Axis::z].value(), 1 + along, 1e-12);
        EXPECT_NEAR(arc->point(i)[Axis::e].value(), 5 + along, 1e-12);
    }
}

TEST(Arc, ASlicersRoundingIsSpreadOverTheArc) {
    const Position to = at(0.0012, 10.0009);
    const auto arc = ArcPath::make(at(10, 0), to, around(ArcDirection::counterclockwise, -10, 0));
    ASSERT_TRUE(arc.ok());
    EXPECT_EQ(arc->point(arc->chords() - 1), to);
    const Measured m = measure(*arc, at(10, 0), 0, 0, 10);
    EXPECT_LE(m.vertex_error_mm_max, 0.001);
}

TEST(Arc, RoundingDoesNotMakeAWholeTurnOfNothing) {
    // The ends differ in their distance from the centre alone.
    for (const auto direction : {ArcDirection::clockwise, ArcDirection::counterclockwise}) {
        const auto arc = ArcPath::make(at(3, 4), at(3.006, 4.008), around(direction, -3, -4));
        ASSERT_TRUE(arc.ok());
        EXPECT_EQ(arc->chords(), 1U);
    }
}

TEST(Arc, WhatIsNoArcIsRefused) {
    const auto cw = ArcDirection::clockwise;
    EXPECT_FALSE(ArcPath::make(at(0, 0), at(10, 0), around(cw, 0, 0)).ok());
    EXPECT_FALSE(ArcPath::make(at(0, 0), at(0, 0), around(cw, 0, 0)).ok());
    EXPECT_FALSE(ArcPath::make(at(0, 0), at(10, 0), around(cw, 4.9, 0)).ok());
    EXPECT_FALSE(ArcPath::make(at(0, 0), at(0, 0), with_radius(cw, 5)).ok());
    EXPECT_FALSE(ArcPath::make(at(0, 0), at(10, 0), with_radius(cw, 4.9)).ok());
    EXPECT_FALSE(ArcPath::make(at(0, 0), at(10, 0), with_radius(cw, 0)).ok());
    EXPECT_FALSE(ArcPath::make(at(0, 0), at(1e-3, 0), around(cw, 1e6, 0)).ok());
    EXPECT_FALSE(ArcPath::make(at(0, 0), at(10, 0), around(cw, 1e200, 1e200)).ok());
    EXPECT_FALSE(ArcPath::make(at(0, 0), at(10, 0), with_radius(cw, 1e200)).ok());
}

TEST(Arc, TurnsInEveryPlaneFromItsFirstAxisToItsSecond) {
    const Axis axes[][3]{
        {Axis::x, Axis::y, Axis::z}, {Axis::z, Axis::x, Axis::y}, {Axis::y, Axis::z, Axis::x}};
    for (const ArcPlane plane : {ArcPlane::xy, ArcPlane::zx, ArcPlane::yz}) {
        const auto& [first, second, third] = axes[static_cast<int>(plane)];
        ArcGeometry quarter = around(ArcDirection::counterclockwise, -10, 0);
        quarter.plane = plane;
        Position from = at(0, 0);
        from[first] = Millimetres{10};
        Position to = at(0, 0);
        to[second] = Millimetres{10};
        to[third] = Millimetres{4};
        const auto arc = ArcPath::make(from, to, quarter);
        ASSERT_TRUE(arc.ok());
        const Position middle = arc->point(arc->chords() / 2 - 1);
        const double along = static_cast<double>(arc->chords() / 2) / arc->chords();
        EXPECT_NEAR(middle[first].value(), 10 * std::cos(along * kPi / 2), 1e-9);
        EXPECT_NEAR(middle[second].value(), 10 * std::sin(along * kPi / 2), 1e-9);
        EXPECT_NEAR(middle[third].value(), 4 * along, 1e-9);
        EXPECT_EQ(arc->point(arc->chords() - 1), to);
    }
}

/// Printrun's arc test begins with such a line: 50 and 25 mm from the centre, in one direction.
TEST(Arc, EndsInOneDirectionFromTheCentreLeaveNothingToTurn) {
    const auto arc = ArcPath::make(at(0, 0, 10), at(15, 20, 20), around(ArcDirection::clockwise, 30, 40));
    ASSERT_TRUE(arc.ok());
    EXPECT_EQ(arc->chords(), 1U);
    EXPECT_EQ(arc->point(0), at(15, 20, 20));
}

TEST(Arc, RandomArcsByCentreAndByRadiusAgree) {
    std::mt19937_64 random{20170418};
    std::uniform_real_distribution<double> coordinate{0, 150};
    std::uniform_real_distribution<double> stretch{1.05, 4};
    for (int round = 0; round < 2000; ++round) {
        const Position from = at(coordinate(random), coordinate(random));
        const Position to = at(coordinate(random), coordinate(random));
        const double chord =
            std::hypot((to[Axis::x] - from[Axis::x]).value(), (to[Axis::y] - from[Axis::y]).value());
        const double radius = chord / 2 * stretch(random) * (round % 2 == 0 ? 1 : -1);
        const auto direction = round % 3 == 0 ? ArcDirection::clockwise : ArcDirection::counterclockwise;
        const auto arc = ArcPath::make(from, to, with_radius(direction, radius));
        ASSERT_TRUE(arc.ok()) << round;
        double length = 0;
        Position last = from;
        for (std::uint32_t i = 0; i < arc->chords(); ++i) {
            const Position next = arc->point(i);
            length +=
                std::hypot((next[Axis::x] - last[Axis::x]).value(), (next[Axis::y] - last[Axis::y]).value());
            last = next;
        }
        // Short or long arc over that chord: 2·r·asin(c/2r), or the rest of the circle.
        const double r = std::abs(radius);
        const double shorter = 2 * r * std::asin(std::min(1.0, chord / 2 / r));
        const double expected = radius > 0 ? shorter : 2 * kPi * r - shorter;
        EXPECT_NEAR(length, expected, expected * 2e-3 + 0.01) << "round " << round;
    }
}

/// Sums of decimal numbers, which are the same point, differ by what rounding leaves.
TEST(Arc, AWholeCircleMayMissItsStartByRounding) {
    double summed = 60;
    for (int i = 0; i < 10; ++i) summed += 0.1;
    ASSERT_NE(summed, 61) << "the case is one of rounding";
    for (const ArcDirection way : {ArcDirection::clockwise, ArcDirection::counterclockwise}) {
        for (const double gap : {summed - 61, 61 - summed, 9e-7, -9e-7}) {
            const auto circle = ArcPath::make(at(61 + gap, 60), at(61, 60), around(way, 10, 0));
            ASSERT_TRUE(circle.ok());
            EXPECT_NEAR(measure(*circle, at(61 + gap, 60), 71, 60, 10).length_mm, 20 * kPi, 0.05) << gap;
            const auto twice = ArcPath::make(at(61 + gap, 60), at(61, 60), around(way, 10, 0, 2));
            ASSERT_TRUE(twice.ok());
            EXPECT_NEAR(measure(*twice, at(61 + gap, 60), 71, 60, 10).length_mm, 40 * kPi, 0.1) << gap;
            EXPECT_FALSE(ArcPath::make(at(61 + gap, 60), at(61, 60), with_radius(way, 10)).ok())
                << "R says nothing of where the centre is";
        }
    }
    // A micrometre is no rounding: the way is nearly whole one way, and nearly nothing the other.
    const auto nearly =
        ArcPath::make(at(60, 60), at(60, 60.001), around(ArcDirection::counterclockwise, 10, 0));
    ASSERT_TRUE(nearly.ok());
    EXPECT_NEAR(measure(*nearly, at(60, 60), 70, 60, 10).length_mm, 20 * kPi, 0.05);
}

}  // namespace
}  // namespace qduino::printer::gcode::arc_test
