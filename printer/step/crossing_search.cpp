#include "printer/step/crossing_search.h"

#include <utility>

namespace qduino::printer::step {
namespace {

/// Times are found to this: a hundredth of a nanosecond.
constexpr double kTime_s = 1e-11;
constexpr int kHalvings = 64;

void keep(Turns& turns, double at, double end) {
    if (at > 0 && at < end) turns.at[turns.count++] = at;
}

Turns quadratic_roots(const Polynomial& p, double end) {
    Turns turns;
    const double a = p.c[2], b = p.c[1], c = p.c[0];
    if (a == 0) {
        if (b != 0) keep(turns, -c / b, end);
        return turns;
    }
    const double under = b * b - 4 * a * c;
    if (under <= 0) return turns;
    const double q = -0.5 * (b + std::copysign(std::sqrt(under), b));
    const double first = q / a;
    const double second = q != 0 ? c / q : first;
    keep(turns, std::min(first, second), end);
    if (first != second) keep(turns, std::max(first, second), end);
    return turns;
}

/// The root of `p` between two places where it has different signs.
double bisect(const Polynomial& p, double low, double high) {
    const bool rises = p.value(high) > 0;
    for (int i = 0; i < kHalvings && high - low > kTime_s; ++i) {
        const double middle = 0.5 * (low + high);
        ((p.value(middle) > 0) == rises ? high : low) = middle;
    }
    return 0.5 * (low + high);
}

}  // namespace

Turns roots_of(const Polynomial& slope, std::size_t degree, double end) {
    while (degree > 2 && slope.c[degree] == 0) --degree;
    if (degree <= 2) return quadratic_roots(slope, end);
    // Between the turns of the slope there is one root at most.
    Turns cuts = roots_of(slope.derivative(), degree - 1, end);
    cuts.at[cuts.count] = end;
    Turns turns;
    double from = 0;
    for (std::size_t i = 0; i <= cuts.count; ++i) {
        const double to = cuts.at[i];
        if ((slope.value(from) > 0) != (slope.value(to) > 0)) keep(turns, bisect(slope, from, to), end);
        from = to;
    }
    return turns;
}

Turns CrossingSearch::turns_of(const Polynomial& steps, double end_s) {
    double others = 0;
    double power = 1;
    for (std::size_t i = 2; i < Polynomial::kTerms; ++i) {
        power *= end_s;
        others += static_cast<double>(i) * std::abs(steps.c[i]) * power;
    }
    if (std::abs(steps.c[1]) > others) return {};
    return roots_of(steps.derivative(), Polynomial::kTerms - 2, end_s);
}

double CrossingSearch::newton_root(double steps) {
    double low = from_s_, high = to_s_;
    // From crossing to crossing it is one step, and speed_ is known.
    const double begin = on_crossing_ ? -1 : past(steps, low);
    if (begin >= 0) return low;
    if (left_ == 0 && way_ * (steps_.value(high) - steps) <= 0) return high;
    // A first guess by the quadratic at `low`: speed, and half of the acceleration.
    const double half = way_ * half_acceleration(low);
    double at = low - 2 * begin / (speed_ + std::sqrt(std::max(speed_ * speed_ - 4 * half * begin, 0.0)));
    if (!(at > low && at < high)) at = 0.5 * (low + high);
    for (int i = 0; i < kHalvings; ++i) {
        const double off = past(steps, at);
        (off > 0 ? high : low) = at;
        double nearer = at - off / speed_;
        const bool inside = nearer > low && nearer < high;
        if (!inside) nearer = 0.5 * (low + high);
        const double before = std::exchange(at, nearer);
        const double moved = std::abs(at - before);
        if (moved <= kTime_s) break;
        // Newton's error is the square of its step, times half of the acceleration over the speed.
        const double bent = std::max(std::abs(half_acceleration(at)), std::abs(half_acceleration(before)));
        if (inside && 2 * moved * moved * bent <= kTime_s * speed_) break;
    }
    return at;
}

}  // namespace qduino::printer::step
