// Corrections: the surface against a naive one, back and forth, and pieces that stay on the
// surface.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "printer/motion/correction.h"

namespace qduino::printer::correction_property_test {
namespace {

using motion::AxisVector;
using motion::BedMesh;
using motion::Correction;

class CorrectionProperty : public testing::TestWithParam<MeshSurface> {
  protected:
    CorrectionProperty() {
        config_.mesh.surface = GetParam();
        config_.mesh.points = {6, 4};
        config_.mesh.maximum = {Millimetres{120}, Millimetres{110}};
        mesh_ = BedMesh{config_.mesh};
        for (std::size_t row = 0; row < 4; ++row)
            for (std::size_t column = 0; column < 6; ++column) mesh_.set(column, row, uniform(-0.2, 0.3));
        config_.skew = {0.01, -0.004, 0.006};
    }
    double uniform(double low, double high) {
        return std::uniform_real_distribution<double>{low, high}(random_);
    }
    AxisVector place() { return {uniform(0, 150), uniform(0, 150), uniform(0, 14), uniform(0, 50)}; }
    Correction correction() {
        Correction made{config_};
        made.set_mesh(mesh_);
        made.use_mesh(true);
        return made;
    }

    MachineConfig config_;
    BedMesh mesh_;
    std::mt19937 random_{11};
};

/// From the definition: Hermite's basis, with half the difference of the neighbours as slopes.
double naive_spline(double a, double b, double c, double d, double s) {
    const double h00 = (1 + 2 * s) * (1 - s) * (1 - s), h10 = s * (1 - s) * (1 - s);
    const double h01 = s * s * (3 - 2 * s), h11 = s * s * (s - 1);
    return h00 * b + h10 * (c - a) / 2 + h01 * c + h11 * (d - b) / 2;
}

TEST_P(CorrectionProperty, TheSurfaceIsTheNaiveOne) {
    const auto height = [&](int column, int row) {
        const auto inner = [&](int c, int r) { return mesh_.point(std::size_t(c), std::size_t(r)); };
        const auto in_row = [&](int r) {
            if (column < 0) return 2 * inner(0, r) - inner(1, r);
            if (column > 5) return 2 * inner(5, r) - inner(4, r);
            return inner(column, r);
        };
        if (row < 0) return 2 * in_row(0) - in_row(1);
        return row > 3 ? 2 * in_row(3) - in_row(2) : in_row(row);
    };
    for (int i = 0; i < 5000; ++i) {
        const double x = uniform(20, 120), y = uniform(20, 110);
        const int column = std::min(int((x - 20) / 20), 4), row = std::min(int((y - 20) / 30), 2);
        const double s = (x - 20) / 20 - column, t = (y - 20) / 30 - row;
        double lines[4];
        for (int k = -1; k < 3; ++k) {
            lines[k + 1] = GetParam() == MeshSurface::bilinear
                               ? height(column, row + k) * (1 - s) + height(column + 1, row + k) * s
                               : naive_spline(height(column - 1, row + k), height(column, row + k),
                                              height(column + 1, row + k), height(column + 2, row + k), s);
        }
        const double naive = GetParam() == MeshSurface::bilinear
                                 ? lines[1] * (1 - t) + lines[2] * t
                                 : naive_spline(lines[0], lines[1], lines[2], lines[3], t);
        ASSERT_NEAR(mesh_.height_at(x, y), naive, 1e-12);
    }
}

TEST_P(CorrectionProperty, TheSurfaceGoesThroughItsPointsAndEndsAtItsEdge) {
    for (std::size_t row = 0; row < 4; ++row)
        for (std::size_t column = 0; column < 6; ++column)
            EXPECT_NEAR(mesh_.height_at(mesh_.line_at(Axis::x, column), mesh_.line_at(Axis::y, row)),
                        mesh_.point(column, row), 1e-12);
    EXPECT_DOUBLE_EQ(mesh_.height_at(-40, 50), mesh_.height_at(20, 50));
    EXPECT_DOUBLE_EQ(mesh_.height_at(60, 400), mesh_.height_at(60, 110));
}

TEST_P(CorrectionProperty, WhatIsCorrectedLeadsBack) {
    const Correction made = correction();
    for (int i = 0; i < 5000; ++i) {
        const AxisVector asked = place();
        const AxisVector back = made.asked_of(made.corrected(asked));
        for (std::size_t axis = 0; axis < kAxisCount; ++axis) ASSERT_NEAR(back[axis], asked[axis], 1e-9);
    }
}

TEST_P(CorrectionProperty, TheBedFadesOut) {
    const Correction made = correction();
    const double height =
        mesh_.height_at(made.corrected({50, 50, 0, 0})[0], made.corrected({50, 50, 0, 0})[1]);
    EXPECT_NEAR(made.corrected({50, 50, 0, 0})[2], height, 1e-12);
    for (const double z : {10.0, 12.0}) EXPECT_EQ(made.corrected({50, 50, z, 0})[2], z);
    Correction lasting = correction();
    lasting.set_fade_end(0);
    EXPECT_NE(lasting.corrected({50, 50, 12, 0})[2], 12);
}

TEST_P(CorrectionProperty, NoPieceLeavesTheSurfaceAndSharesGoUp) {
    const Correction made = correction();
    std::size_t most = 0;
    for (int i = 0; i < 2000; ++i) {
        const AxisVector from = place();
        AxisVector to = place();
        if (i % 3 == 0) to[2] = from[2];
        const Correction::Pieces pieces = made.split(from, to);
        most = std::max(most, pieces.size());
        ASSERT_EQ(pieces.back().end, made.corrected(to));
        ASSERT_EQ(pieces.back().share, 1);
        double begin = 0;
        AxisVector last = made.corrected(from);
        for (const Correction::Piece& piece : pieces) {
            ASSERT_GT(piece.share, begin);
            for (const double part : {0.1, 0.3, 0.5, 0.8}) {
                const double share = begin + part * (piece.share - begin);
                AxisVector asked{};
                for (std::size_t k = 0; k < kAxisCount; ++k) asked[k] = from[k] + share * (to[k] - from[k]);
                const double straight = last[2] + part * (piece.end[2] - last[2]);
                ASSERT_NEAR(made.corrected(asked)[2], straight, 1.5 * Correction::kSplitError_mm);
            }
            begin = piece.share;
            last = piece.end;
        }
    }
    EXPECT_LT(most, Correction::kPiecesMax) << "the limit was not what ended the splitting";
}

INSTANTIATE_TEST_SUITE_P(Both, CorrectionProperty,
                         testing::Values(MeshSurface::bilinear, MeshSurface::bicubic));

TEST(Correction, AFlatAndSquareMachineIsLeftAlone) {
    Correction made{MachineConfig{}};
    EXPECT_FALSE(made.active());
    const AxisVector place{1.25, -3.5, 7, 9};
    EXPECT_EQ(made.corrected(place), place);
    EXPECT_EQ(made.asked_of(place), place);
    made.use_mesh(true);
    EXPECT_FALSE(made.active()) << "nothing has been measured";
    EXPECT_TRUE(made.take_stale());
    EXPECT_FALSE(made.take_stale());
}

TEST(Correction, SkewIsMarlins) {
    MachineConfig config;
    config.skew = {0.01, 0.02, 0.03};
    const AxisVector at = Correction{config}.corrected({100, 50, 20, 0});
    EXPECT_DOUBLE_EQ(at[0], 100 - 50 * 0.01 - 20 * (0.02 - 0.01 * 0.03));
    EXPECT_DOUBLE_EQ(at[1], 50 - 20 * 0.03);
    EXPECT_EQ(at[2], 20);
}

}  // namespace
}  // namespace qduino::printer::correction_property_test
