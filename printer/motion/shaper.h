// Input shapers: a few scaled and delayed copies of a motion, whose vibrations cancel each other.
//
// An axis on its belt swings like a mass on a spring, at its frequency f and with its damping ratio
// ζ. A move excites it. A copy of the move half a period later excites the same swing upside down:
//
//     impulse     A1          A2                     d = √(1 − ζ²),  T = 1/(f·d) the damped period,
//                 |           |                      K = e^(−ζπ/d) what is left of a swing after
//     swing      / \       , - .                     half a period
//        -------+---\-----/-----\------> time
//                    '---'   T/2                     the two swings cancel when A2 = K·A1
//
// More impulses forgive a wrong frequency. Sources: ZV, ZVD: Singer and Seering, "Preshaping
// command inputs to reduce system vibration", 1990. EI and two-hump EI, which leave v = 5 % at f,
// or on both sides of it, to be small around it: Singhose, Seering and Singer, "Residual vibration
// reduction using vector diagrams", 1994, and "Input shaping for vibration reduction with specified
// insensitivity", 1996. MZV: a Klipper original (its documentation, "Resonance Compensation").
// Amplitudes and times are Klipper's.
//
// The sum of the amplitudes is 1, so a place at rest stays where it is. The delays are centred (the
// sum of amplitude times delay is 0), so a constant speed is unchanged and no axis lags behind an
// axis with another shaper.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "printer/machine_config.h"

namespace qduino::printer::motion {

/// The shaped position at t is the sum of share[i] · position(t + ahead_s[i]).
struct Impulses {
    static constexpr std::size_t kMax = 4;
    std::size_t count = 1;
    std::array<double, kMax> share{1};
    std::array<double, kMax> ahead_s{};

    /// How far into the future the motion must be known.
    [[nodiscard]] double future_s() const { return ahead_s[0]; }
    /// … and for how long it is remembered.
    [[nodiscard]] double past_s() const { return -ahead_s[count - 1]; }
};

namespace shaper_details {

/// Amplitudes as they stand, times as shares of the damped period.
struct Pattern {
    std::size_t count = 1;
    std::array<double, Impulses::kMax> amplitude{1};
    std::array<double, Impulses::kMax> time{};
};

/// The vibration that EI shapers leave at their frequency.
inline constexpr double kTolerance = 0.05;

/// `k`: what is left of a swing after half a period.
inline Pattern pattern(ShaperType type, double k) {
    constexpr double v = kTolerance;
    switch (type) {
        case ShaperType::none:
            break;
        case ShaperType::zv:
            return {2, {1, k}, {0, 0.5}};
        case ShaperType::zvd:
            return {3, {1, 2 * k, k * k}, {0, 0.5, 1}};
        case ShaperType::mzv: {
            const double three_quarters = std::pow(k, 0.75);
            const double outer = 1 - 1 / std::numbers::sqrt2;
            const double middle = (std::numbers::sqrt2 - 1) * three_quarters;
            return {3, {outer, middle, outer * three_quarters * three_quarters}, {0, 0.375, 0.75}};
        }
        case ShaperType::ei:
            return {3, {(1 + v) / 4, (1 - v) / 2 * k, (1 + v) / 4 * k * k}, {0, 0.5, 1}};
        case ShaperType::two_hump_ei: {
            const double x = std::cbrt(v * v * (std::sqrt(1 - v * v) + 1));
            const double outer = (3 * x * x + 2 * x + 3 * v * v) / (16 * x);
            const double inner = 0.5 - outer;
            return {4, {outer, inner * k, inner * k * k, outer * k * k * k}, {0, 0.5, 1, 1.5}};
        }
    }
    return {};
}

}  // namespace shaper_details

/// The impulses of `shaper`; of one that is not active, the position itself.
inline Impulses impulses_of(const ShaperConfig& shaper) {
    if (!shaper.active()) return {};
    const double damped = std::sqrt(1 - shaper.damping_ratio * shaper.damping_ratio);
    const double left = std::exp(-shaper.damping_ratio * std::numbers::pi / damped);
    const shaper_details::Pattern pattern = shaper_details::pattern(shaper.type, left);
    const double period_s = 1 / (shaper.frequency_hz * damped);
    double sum = 0;
    double moment = 0;
    for (std::size_t i = 0; i < pattern.count; ++i) {
        sum += pattern.amplitude[i];
        moment += pattern.amplitude[i] * pattern.time[i];
    }
    Impulses impulses{.count = pattern.count};
    for (std::size_t i = 0; i < pattern.count; ++i) {
        impulses.share[i] = pattern.amplitude[i] / sum;
        impulses.ahead_s[i] = (moment / sum - pattern.time[i]) * period_s;
    }
    return impulses;
}

}  // namespace qduino::printer::motion
