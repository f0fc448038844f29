// When does a motor cross from one microstep to the next? The crossings of one window of its
// position (motor_path.h), one after the other.
//
//   steps ^            .-·-.  turn          the window is cut at its turns; on each monotone piece
//   k+3/2 |- - - - -.-'- - -'-.- - - -      the count at the end, rounded, says how many half-steps
//   k+1/2 |- - -.-'            '-.          lie on it, and each is then one root in a bracket
//         |_.-'|               |  '
//         +----*----*-------*-----*---> time
//
// The number of steps follows from where a piece ends, so no step is lost or made twice, and no
// rounding adds up. A piece that ends a rounding error beside a half-step, and would ask for a step
// against its own way, makes none: the next piece decides.
//
// A quadratic is solved in closed form, without cancellation (motion/trapezoid.h). A polynomial of
// higher degree is solved by Newton's method from the quadratic at the step before; a bracket
// catches what leaves it. Where the motor nearly stands, the instant of a crossing is
// ill-conditioned: the place is right to a rounding error, the time to that over the speed.
//
// Turns are the roots of the slope: none at all, when the slope at the begin outweighs all that
// the other terms can add; else closed form for up to a cubic position, and for more by bisection
// between the turns of the slope itself.
//
// Pure; no heap.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "printer/step/polynomial.h"

namespace qduino::printer::step {

/// The whole step nearest to `steps`; of a half the upper one.
inline std::int64_t whole_steps(double steps) { return static_cast<std::int64_t>(std::floor(steps + 0.5)); }

/// Places where a curve changes direction, ascending.
struct Turns {
    std::size_t count = 0;
    std::array<double, Polynomial::kTerms> at{};
};
/// The roots of `slope` (of degree `degree` at most) inside 0 … `end`.
[[nodiscard]] Turns roots_of(const Polynomial& slope, std::size_t degree, double end);

class CrossingSearch {
  public:
    /// Starts on `steps`, a motor's place for times 0 … `end_s`.
    void begin(const Polynomial& steps, double end_s) {
        steps_ = steps;
        quadratic_ = steps.is_quadratic();
        cubic_ = steps.c[4] == 0 && steps.c[5] == 0;
        turns_ = turns_of(steps, end_s);
        turns_.at[turns_.count] = end_s;
        piece_ = 0;
        left_ = 0;
        from_s_ = 0;
        to_s_ = 0;
    }

    /// The next crossing: its time, and the way that `count` then goes; 0: none is left here.
    /// `count` goes along.
    [[nodiscard]] int next(std::int64_t& count, double& at_s) {
        while (left_ == 0) {
            if (piece_ > turns_.count) return 0;
            from_s_ = to_s_;
            on_crossing_ = false;
            to_s_ = turns_.at[piece_++];
            const double begin = steps_.value(from_s_);
            const double end = steps_.value(to_s_);
            const std::int64_t change = whole_steps(end) - count;
            way_ = change > 0 ? 1 : -1;
            if (change == 0 || (end - begin) * way_ <= 0) continue;
            left_ = change > 0 ? change : -change;
        }
        --left_;
        at_s = from_s_ = root(static_cast<double>(count) + 0.5 * way_);
        on_crossing_ = true;
        count += way_;
        return way_;
    }

  private:
    [[nodiscard]] static Turns turns_of(const Polynomial& steps, double end_s);
    /// Where the present piece is at `steps`, from from_s_ on.
    [[nodiscard]] double root(double steps) {
        return quadratic_ ? std::clamp(quadratic_root(steps), from_s_, to_s_) : newton_root(steps);
    }
    /// The root of c1·t + c2·t² = Δ, on the branch where the slope has the sign of way_.
    [[nodiscard]] double quadratic_root(double steps) const {
        const double change = steps - steps_.c[0];
        const double speed = steps_.c[1];
        const double root = way_ * std::sqrt(std::max(speed * speed + 4 * steps_.c[2] * change, 0.0));
        if (speed * way_ < 0) return (root - speed) / (2 * steps_.c[2]);
        // A motor that rests on the very half-step crosses it at once.
        return speed + root != 0 ? 2 * change / (speed + root) : 0;
    }
    [[nodiscard]] double newton_root(double steps);
    [[nodiscard]] double half_acceleration(double t) const {
        const auto& c = steps_.c;
        return c[2] + t * (3 * c[3] + t * (6 * c[4] + t * 10 * c[5]));
    }
    /// How far the motor is past `steps` at `t`, along its way; the speed there goes into speed_.
    [[nodiscard]] double past(double steps, double t) {
        const auto& c = steps_.c;
        if (cubic_) {
            speed_ = way_ * (c[1] + t * (2 * c[2] + t * 3 * c[3]));
            return way_ * (c[0] - steps + t * (c[1] + t * (c[2] + t * c[3])));
        }
        speed_ = way_ * steps_.slope(t);
        return way_ * (steps_.value(t) - steps);
    }

    Polynomial steps_;
    Turns turns_;  // and the end of the window behind them
    std::size_t piece_ = 0;
    std::int64_t left_ = 0;  // crossings on the present piece
    int way_ = 1;
    bool quadratic_ = true;
    bool cubic_ = true;         // at most
    bool on_crossing_ = false;  // from_s_ is the crossing before
    double speed_ = 0;          // along the way, where it was last looked at
    double from_s_ = 0;         // the present piece, from the last crossing on
    double to_s_ = 0;
};

}  // namespace qduino::printer::step
