// Filtered motion, written down a second time and slowly: the position of an axis at any time, from
// the planner's segments, by numerical integration.
//
// The speed along the way comes from the segment's speeds and times alone. The filters are applied
// as their definitions say: a shaper is a sum over delayed positions, and smoothing is an integral
// over the weight, by Gauss and Legendre's rule of three places between the instants at which the
// motion has a kink (exact up to the fifth degree; place times weight has the fourth at most).
// Nothing is shared with the solver: no polynomial, no window.
#pragma once

#include <algorithm>
#include <cmath>
#include <deque>
#include <numbers>
#include <vector>

#include "printer/motion/segment.h"

namespace qduino::test {

using Real = long double;

/// A sum of delayed positions, centred so that a constant speed is unchanged.
struct SampledShaper {
    std::vector<Real> amplitude{1};
    std::vector<Real> delay_s{0};

    SampledShaper() = default;
    explicit SampledShaper(const printer::ShaperConfig& shaper) {
        if (!shaper.active()) return;
        const Real z = shaper.damping_ratio, root = std::sqrt(1 - z * z);
        const Real period = 1 / (shaper.frequency_hz * root), pi = std::numbers::pi_v<Real>;
        // What a swing that is `share` of a period old has left.
        const auto left = [&](Real share) { return std::exp(-2 * pi * share * z / root); };
        const auto add = [&](Real a, Real share) {
            amplitude.push_back(a * left(share));
            delay_s.push_back(share * period);
        };
        amplitude.clear();
        delay_s.clear();
        const Real v = 0.05L, half = 1 / std::sqrt(Real{2});
        switch (shaper.type) {
            case printer::ShaperType::none:
                break;
            case printer::ShaperType::zv:
                add(1, 0), add(1, 0.5L);
                break;
            case printer::ShaperType::zvd:
                add(1, 0), add(2, 0.5L), add(1, 1);
                break;
            case printer::ShaperType::mzv:
                add(1 - half, 0), add(2 * half - 1, 0.375L), add(1 - half, 0.75L);
                break;
            case printer::ShaperType::ei:
                add((1 + v) / 4, 0), add((1 - v) / 2, 0.5L), add((1 + v) / 4, 1);
                break;
            case printer::ShaperType::two_hump_ei: {
                const Real x = std::cbrt(v * v * (std::sqrt(1 - v * v) + 1));
                const Real a = (3 * x * x + 2 * x + 3 * v * v) / (16 * x);
                add(a, 0), add(0.5L - a, 0.5L), add(0.5L - a, 1), add(a, 1.5L);
                break;
            }
        }
        Real sum = 0, mean = 0;
        for (const Real a : amplitude) sum += a;
        for (std::size_t i = 0; i < amplitude.size(); ++i) mean += amplitude[i] * delay_s[i] / sum;
        for (Real& a : amplitude) a /= sum;
        for (Real& delay : delay_s) delay -= mean;
    }
};

/// How much later than planned everything is played: as far as filters look ahead.
inline Real lead_s(const printer::motion::MotionFilters& filters) {
    Real ahead = filters.smooth_time.value() / 2;
    for (const printer::ShaperConfig& shaper : filters.shapers)
        ahead = std::max(ahead, -SampledShaper{shaper}.delay_s.front());
    return std::ceil(ahead * 1e9L) * 1e-9L;
}

class SampledMotion {
  public:
    explicit SampledMotion(const printer::motion::MotionFilters& filters)
        : half_s_(filters.smooth_time.value() / 2) {
        for (std::size_t i = 0; i < 2; ++i) shapers_[i] = SampledShaper{filters.shapers[i]};
    }
    /// The next move of the plan.
    void append(const printer::motion::Segment& move) {
        segments_.push_back(move);
        for (const Real kink : kinks_of(move.shape)) kinks_.push_back(begin_of(move) + kink);
    }
    /// Nobody asks for what filters do not need from `from_s` of the plan on.
    void forget_before(Real from_s) {
        while (segments_.size() > 1 && begin_of(segments_[1]) < from_s) segments_.pop_front();
        while (!kinks_.empty() && kinks_.front() < from_s) kinks_.pop_front();
    }
    /// Nothing was planned: the motors do not move.
    [[nodiscard]] bool empty() const { return segments_.empty(); }

    /// mm, behind the filter of `axis`.
    [[nodiscard]] Real position(std::size_t axis, Real at_s) const {
        if (axis == 3 && half_s_ > 0) return smoothed(at_s);
        if (axis > 1) return planned(axis, at_s);
        Real sum = 0;
        const SampledShaper& shaper = shapers_[axis];
        for (std::size_t i = 0; i < shaper.amplitude.size(); ++i)
            sum += shaper.amplitude[i] * planned(axis, at_s - shaper.delay_s[i]);
        return sum;
    }
    [[nodiscard]] Real end_s() const {
        return begin_of(segments_.back()) + segments_.back().shape.duration_s();
    }

  private:
    struct Along {
        Real mm = 0, speed = 0;
    };

    static Real begin_of(const printer::motion::Segment& segment) {
        return (static_cast<Real>(segment.start.ns) + segment.start.fraction_ns) * 1e-9L;
    }

    // ---- the plan -------------------------------------------------------------------------------

    /// One change of speed after `t`: constant acceleration, or growing, staying and falling.
    static Along ramp(const printer::motion::Trapezoid& shape, Real from, Real to, Real duration, Real t) {
        const Real sign = to < from ? -1 : 1;
        if (shape.jerk_mm_s3 <= 0) {
            const Real a = sign * shape.acceleration_mm_s2;
            return {from * t + a * t * t / 2, from + a * t};
        }
        const Real grows =
            std::min<Real>(duration / 2, static_cast<Real>(shape.acceleration_mm_s2) / shape.jerk_mm_s3);
        const Real j = sign * shape.jerk_mm_s3, a = j * grows;
        if (t <= grows) return {from * t + j * t * t * t / 6, from + j * t * t / 2};
        const Along one{from * grows + j * grows * grows * grows / 6, from + a * grows / 2};
        const Real flat = duration - 2 * grows, t2 = std::min(t - grows, flat);
        const Along two{one.mm + one.speed * t2 + a * t2 * t2 / 2, one.speed + a * t2};
        if (t <= grows + flat) return two;
        const Real t3 = t - grows - flat;
        return {two.mm + two.speed * t3 + a * t3 * t3 / 2 - j * t3 * t3 * t3 / 6,
                two.speed + a * t3 - j * t3 * t3 / 2};
    }

    static Along along(const printer::motion::Trapezoid& shape, Real t) {
        if (t <= shape.accelerate_s)
            return ramp(shape, shape.entry_speed_mm_s, shape.cruise_speed_mm_s, shape.accelerate_s, t);
        const Real ramp_mm =
            (static_cast<Real>(shape.entry_speed_mm_s) + shape.cruise_speed_mm_s) / 2 * shape.accelerate_s;
        const Real cruised = std::min<Real>(t - shape.accelerate_s, shape.cruise_s);
        const Real cruise_mm = ramp_mm + cruised * shape.cruise_speed_mm_s;
        if (t <= shape.accelerate_s + shape.cruise_s) return {cruise_mm, shape.cruise_speed_mm_s};
        const Along brake = ramp(shape, shape.cruise_speed_mm_s, shape.exit_speed_mm_s, shape.decelerate_s,
                                 t - shape.accelerate_s - shape.cruise_s);
        return {cruise_mm + brake.mm, brake.speed};
    }

    static std::vector<Real> kinks_of(const printer::motion::Trapezoid& shape) {
        std::vector<Real> kinks;
        const auto add_ramp = [&](Real from, Real duration) {
            if (shape.jerk_mm_s3 > 0) {
                const Real grows = std::min<Real>(
                    duration / 2, static_cast<Real>(shape.acceleration_mm_s2) / shape.jerk_mm_s3);
                kinks.push_back(from + grows);
                kinks.push_back(from + duration - grows);
            }
            kinks.push_back(from + duration);
        };
        kinks.push_back(0);
        add_ramp(0, shape.accelerate_s);
        kinks.push_back(static_cast<Real>(shape.accelerate_s) + shape.cruise_s);
        add_ramp(static_cast<Real>(shape.accelerate_s) + shape.cruise_s, shape.decelerate_s);
        return kinks;  // ascending
    }

    [[nodiscard]] const printer::motion::Segment& segment_at(Real at_s) const {
        const auto after = std::upper_bound(segments_.begin(), segments_.end(), at_s,
                                            [](Real t, const auto& s) { return t < begin_of(s); });
        return after == segments_.begin() ? segments_.front() : *(after - 1);
    }
    [[nodiscard]] Real planned(std::size_t axis, Real at_s) const {
        const auto& segment = segment_at(at_s);
        const Real t = std::clamp<Real>(at_s - begin_of(segment), 0, segment.shape.duration_s());
        const Real share = along(segment.shape, t).mm / segment.shape.length_mm;
        return segment.start_mm[axis] +
               share * (static_cast<Real>(segment.end_mm[axis]) - segment.start_mm[axis]);
    }
    // ---- the filament ---------------------------------------------------------------------------

    /// The filament's place plus advance times its speed. `between`: the kinks on both sides, so
    /// that it is clear which move is meant.
    [[nodiscard]] Real pressed(Real at_s, Real between_s) const {
        const auto& segment = segment_at(between_s);
        const Real begin_s = begin_of(segment), duration_s = segment.shape.duration_s();
        if (between_s < begin_s) return segment.start_mm[3];
        if (between_s > begin_s + duration_s) return segment.end_mm[3];
        const Along way = along(segment.shape, std::clamp<Real>(at_s - begin_s, 0, duration_s));
        const Real share =
            (static_cast<Real>(segment.end_mm[3]) - segment.start_mm[3]) / segment.shape.length_mm;
        return segment.start_mm[3] + share * (way.mm + segment.advance_s * way.speed);
    }
    [[nodiscard]] Real smoothed(Real at_s) const {
        Real sum = 0, from = at_s - half_s_;
        const auto add_until = [&](Real to) {
            sum += integral(from, to, at_s);
            from = to;
        };
        auto kink = std::upper_bound(kinks_.begin(), kinks_.end(), from);
        // The weight has a kink of its own, in the middle.
        for (const Real end : {at_s, at_s + half_s_}) {
            for (; kink != kinks_.end() && *kink < end; ++kink) add_until(*kink);
            add_until(end);
        }
        return sum;
    }
    /// The integral of the place times the weight, which falls from the middle to both sides.
    [[nodiscard]] Real integral(Real from, Real to, Real at_s) const {
        if (to - from < 1e-15L) return 0;
        static const Real kAside = std::sqrt(Real{3} / 5);
        const Real wide = (to - from) / 2, middle = (from + to) / 2;
        const auto value = [&](Real at) {
            return pressed(at, middle) * (half_s_ - std::abs(at - at_s)) / (half_s_ * half_s_);
        };
        return wide / 9 *
               (5 * value(middle - kAside * wide) + 8 * value(middle) + 5 * value(middle + kAside * wide));
    }

    std::deque<printer::motion::Segment> segments_;
    Real half_s_ = 0;
    std::array<SampledShaper, 2> shapers_;
    std::deque<Real> kinks_;
};

}  // namespace qduino::test
