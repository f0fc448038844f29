#include "printer/step/motor_path.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace qduino::printer::step {
namespace {

constexpr std::size_t kNodes = Polynomial::kTerms;

/// Zeros of T6, and the powers' coefficients of the polynomial through values there: both for times
/// from 0 to 1.
struct Interpolation {
    std::array<double, kNodes> node{};
    std::array<std::array<double, kNodes>, kNodes> term{};  // [power][node]

    Interpolation() {
        for (std::size_t i = 0; i < kNodes; ++i)
            node[i] = 0.5 - 0.5 * std::cos(std::numbers::pi * (2.0 * static_cast<double>(i) + 1) / 12);
        for (std::size_t i = 0; i < kNodes; ++i) {
            // Lagrange: the product of (t − node) over the others, 1 at its own.
            std::array<double, kNodes> product{1};
            double scale = 1;
            for (std::size_t other = 0; other < kNodes; ++other) {
                if (other == i) continue;
                scale *= node[i] - node[other];
                for (std::size_t power = kNodes; power-- > 0;)
                    product[power] = (power > 0 ? product[power - 1] : 0) - node[other] * product[power];
            }
            for (std::size_t power = 0; power < kNodes; ++power) term[power][i] = product[power] / scale;
        }
    }
};
const Interpolation kInterpolation;

}  // namespace

void MotorPath::configure(const motion::MotionSettings& settings, const motion::MotionFilters& filters,
                          std::size_t motor) {
    kinematics_ = settings.kinematics;
    motor_ = motor;
    steps_per_mm_ = settings.steps_per_mm[motor];
    axes_ = 0;
    const double at_zero = kinematics_.motors_from_tool({})[motor];
    for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
        motion::AxisVector unit{};
        unit[axis] = 1;
        row_[axis] = kinematics_.motors_from_tool(unit)[motor] - at_zero;
        if (row_[axis] != 0) axes_ |= 1u << axis;
        const bool shaped = axis < filters.shapers.size();
        const bool smoothed = axis == static_cast<std::size_t>(Axis::e);
        paths_[axis].set_filter(shaped ? motion::impulses_of(filters.shapers[axis]) : motion::Impulses{},
                                smoothed ? half_smoothing_s(filters) : 0);
    }
    // X, Y and Z together, or a motor of its own.
    if (!kinematics_.is_linear() && motor_ != static_cast<std::size_t>(Axis::e)) axes_ = 0b0111;
}

void MotorPath::begin(const MotionTrack& track, double at_s) {
    start_s_ = end_s_ = at_s;
    for (std::size_t axis = 0; axis < kAxisCount; ++axis)
        if (moved_by(axis)) paths_[axis].begin(track, axis, at_s);
}

bool MotorPath::next(const MotionTrack& track) {
    for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
        while (moved_by(axis) && paths_[axis].end_s() <= end_s_)
            if (!paths_[axis].next(track)) return false;
    }
    start_s_ = end_s_;
    end_s_ = start_s_ + 1e9;
    for (std::size_t axis = 0; axis < kAxisCount; ++axis)
        if (moved_by(axis)) end_s_ = std::min(end_s_, paths_[axis].end_s());
    if (kinematics_.is_linear() || motor_ == static_cast<std::size_t>(Axis::e)) {
        combine();
    } else {
        interpolate();
    }
    return true;
}

void MotorPath::combine() {
    steps_ = Polynomial{};
    for (std::size_t axis = 0; axis < kAxisCount; ++axis) {
        if (!moved_by(axis)) continue;
        const AxisPath& path = paths_[axis];
        steps_.add(path.position().shifted(start_s_ - path.start_s()), row_[axis] * steps_per_mm_);
    }
}

double MotorPath::motor_at(double after_s) const {
    motion::AxisVector tool{};
    for (std::size_t axis = 0; axis < kAxisCount; ++axis)
        if (moved_by(axis))
            tool[axis] = paths_[axis].position().value(start_s_ - paths_[axis].start_s() + after_s);
    return kinematics_.motors_from_tool(tool)[motor_];
}

void MotorPath::interpolate() {
    double span_s = std::min(end_s_ - start_s_, kWindowMax_s);
    for (int halved = 0;; ++halved, span_s *= 0.5) {
        steps_ = Polynomial{};
        double scale = 1;
        std::array<double, kNodes> values;
        for (std::size_t i = 0; i < kNodes; ++i) values[i] = motor_at(span_s * kInterpolation.node[i]);
        for (std::size_t power = 0; power < kNodes; ++power, scale *= span_s)
            for (std::size_t i = 0; i < kNodes && scale > 0; ++i)
                steps_.c[power] += kInterpolation.term[power][i] * values[i] / scale;
        const double begin_off = std::abs(steps_.value(0) - motor_at(0));
        const double end_off = std::abs(steps_.value(span_s) - motor_at(span_s));
        if (std::max(begin_off, end_off) <= kInterpolation_mm || halved == 12) break;
    }
    end_s_ = start_s_ + span_s;
    steps_.scale(steps_per_mm_);
}

std::uint64_t MotorPath::oldest() const {
    std::uint64_t number = ~std::uint64_t{0};
    for (std::size_t axis = 0; axis < kAxisCount; ++axis)
        if (moved_by(axis)) number = std::min(number, paths_[axis].oldest());
    return number;
}

double MotorPath::future_s() const {
    double longest = 0;
    for (std::size_t axis = 0; axis < kAxisCount; ++axis)
        if (moved_by(axis)) longest = std::max(longest, paths_[axis].future_s());
    return longest;
}

double MotorPath::past_s() const {
    double longest = 0;
    for (std::size_t axis = 0; axis < kAxisCount; ++axis)
        if (moved_by(axis)) longest = std::max(longest, paths_[axis].past_s());
    return longest;
}

}  // namespace qduino::printer::step
