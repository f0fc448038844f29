// A polynomial in time: the position of an axis or of a motor over a window of time.
//
// Values and slopes by Horner's scheme. Degree 5 is the most that comes up: planned motion has 2 (a
// trapezoid of speed) or 3 (limited jerk), and smoothing the filament's way adds 2.
#pragma once

#include <array>
#include <cstddef>

namespace qduino::printer::step {

struct Polynomial {
    static constexpr std::size_t kTerms = 6;
    /// The coefficients of 1, t, t² …, with t in seconds.
    std::array<double, kTerms> c{};

    [[nodiscard]] double value(double t) const {
        return c[0] + t * (c[1] + t * (c[2] + t * (c[3] + t * (c[4] + t * c[5]))));
    }
    [[nodiscard]] double slope(double t) const {
        return c[1] + t * (2 * c[2] + t * (3 * c[3] + t * (4 * c[4] + t * 5 * c[5])));
    }
    /// No term above t².
    [[nodiscard]] bool is_quadratic() const { return c[3] == 0 && c[4] == 0 && c[5] == 0; }

    /// The same curve, its time counted from `by`: p(t + by).
    void shift(double by) {
        if (by == 0) return;
        // Repeated synthetic division (Horner-Ruffini): each round yields one coefficient.
        for (std::size_t done = 0; done + 1 < kTerms; ++done)
            for (std::size_t i = kTerms - 1; i-- > done;) c[i] += by * c[i + 1];
    }
    [[nodiscard]] Polynomial shifted(double by) const {
        Polynomial moved = *this;
        moved.shift(by);
        return moved;
    }
    /// p(−t).
    [[nodiscard]] Polynomial mirrored() const { return {{c[0], -c[1], c[2], -c[3], c[4], -c[5]}}; }
    [[nodiscard]] Polynomial derivative() const {
        return {{c[1], 2 * c[2], 3 * c[3], 4 * c[4], 5 * c[5], 0}};
    }
    void add(const Polynomial& other, double scale = 1) {
        for (std::size_t i = 0; i < kTerms; ++i) c[i] += scale * other.c[i];
    }
    void scale(double by) {
        for (double& term : c) term *= by;
    }
};

}  // namespace qduino::printer::step
