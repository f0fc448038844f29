// Random move lists as printers see them, and worse: perimeters, curves of tiny segments, travels,
// retractions, Z hops, spiral vases, reversals on the spot. Positions are on the 0.001 mm grid of
// G-code, so that exact half-steps happen (Z: every odd multiple of 0.025 mm at 2020 steps/mm).
#pragma once

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "printer/motion/planner.h"

namespace qduino::test {

using printer::motion::AxisVector;
using printer::motion::Move;

class RandomMoves {
  public:
    RandomMoves(std::uint64_t seed, const AxisVector& start_mm) : random_(seed), at_(start_mm) {}

    /// The next `count` moves, in one style or another.
    std::vector<Move> take(std::size_t count) {
        std::vector<Move> moves;
        while (moves.size() < count) append_some(moves);
        moves.resize(count);
        return moves;
    }

    double uniform(double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random_);
    }
    int choice(int count) { return std::uniform_int_distribution<int>(0, count - 1)(random_); }

  private:
    static double on_grid(double mm) { return std::round(mm * 1000) / 1000; }

    void go(std::vector<Move>& moves, double dx, double dy, double dz, double e, double speed) {
        at_[0] = std::clamp(on_grid(at_[0] + dx), 0.0, 150.0);
        at_[1] = std::clamp(on_grid(at_[1] + dy), 0.0, 150.0);
        at_[2] = std::clamp(on_grid(at_[2] + dz), 0.0, 150.0);
        moves.push_back({{at_[0], at_[1], at_[2]}, e, speed, uniform(500, 5000)});
    }

    void append_some(std::vector<Move>& moves) {
        const double speed = uniform(1, 200);
        switch (choice(8)) {
            case 0:
                return go(moves, uniform(-80, 80), uniform(-80, 80), 0, 0, speed);  // travel
            case 1:
                // Line.
                return go(moves, uniform(-5, 5), uniform(-5, 5), 0, uniform(0, 0.3), speed);
            case 2:
                return go(moves, 0, 0, 0.025 * (choice(41) - 20), 0, speed);  // Z alone
            case 3:
                return go(moves, 0, 0, 0, uniform(-3, 3), speed);  // E alone
            case 4:
                return curve(moves, 0, speed);
            case 5:
                return curve(moves, 0.001, speed);  // spiral vase
            case 6:
                return there_and_back(moves, speed);
            default:
                // Tiny.
                return go(moves, 0.001 * choice(3), 0.001 * choice(3), 0, 0.001 * choice(2), speed);
        }
    }
    void curve(std::vector<Move>& moves, double rise, double speed) {
        const double length = uniform(0.002, 1);
        double heading = uniform(0, 6.3);
        const double turn = uniform(-0.3, 0.3);
        for (int i = choice(60); i >= 0; --i, heading += turn) {
            go(moves, length * std::cos(heading), length * std::sin(heading), rise, 0.033 * length, speed);
        }
    }
    void there_and_back(std::vector<Move>& moves, double speed) {
        const double dx = on_grid(uniform(-1, 1)), dy = choice(2) * on_grid(uniform(-1, 1)),
                     dz = 0.025 * choice(3);
        for (int i = choice(6); i >= 0; --i)
            go(moves, i % 2 ? dx : -dx, i % 2 ? dy : -dy, i % 2 ? dz : -dz, 0, speed);
    }

    std::mt19937_64 random_;
    AxisVector at_;
};

}  // namespace qduino::test
