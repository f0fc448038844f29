#include "printer/heat/model_tuning.h"

#include <cmath>
#include <utility>

namespace qduino::printer::heat {
namespace {

/// Warmer than this is no room.
constexpr double kWarmestRoom = 45;
/// At rest: no further than this from where it was for so long.
constexpr double kRestCelsius = 0.5;
constexpr double kRestS = 10;
constexpr double kSettleAtMostS = 1800;
constexpr double kHeatAtMostS = 1800;
/// The lag has died away, by the share of the rise.
constexpr double kFitFrom = 0.15;
/// A rest, and a hold, in time constants of the approach.
constexpr double kRestApproaches = 10;
constexpr double kHoldApproaches = 12;

}  // namespace

// ---- the fit ------------------------------------------------------------------------------------

void StepFit::add(double time_s, double rise, double integral) {
    const std::array<double, 4> row{time_s, -integral, -1, rise};
    for (std::size_t i = 0; i < sums_.size(); ++i) {
        for (std::size_t j = 0; j < row.size(); ++j) sums_[i][j] += row[i] * row[j];
    }
}

/// Gauss's elimination with the largest pivot.
std::optional<StepFit::Numbers> StepFit::solve() const {
    auto m = sums_;
    for (std::size_t column = 0; column < m.size(); ++column) {
        std::size_t best = column;
        for (std::size_t row = column; row < m.size(); ++row)
            if (std::abs(m[row][column]) > std::abs(m[best][column])) best = row;
        std::swap(m[column], m[best]);
        if (std::abs(m[column][column]) < 1e-9) return std::nullopt;
        for (std::size_t row = 0; row < m.size(); ++row) {
            if (row == column) continue;
            const double factor = m[row][column] / m[column][column];
            for (std::size_t i = column; i < m[row].size(); ++i) m[row][i] -= factor * m[column][i];
        }
    }
    const double a = m[0][3] / m[0][0], b = m[1][3] / m[1][1], c = m[2][3] / m[2][2];
    if (!(a > 0) || !(b > 0) || !(c > 0)) return std::nullopt;
    return Numbers{a, b, c / a};
}

// ---- the experiment -----------------------------------------------------------------------------

ModelTuning::ModelTuning(const HeaterModel& start, double target_celsius, bool with_fan)
    : model_(start), target_(target_celsius), with_fan_(with_fan) {}

void ModelTuning::enter(Phase phase) {
    phase_ = phase;
    since_s_ = integral_ = mean_celsius_ = 0;
}

void ModelTuning::fail(std::string_view why) {
    failure_ = why;
    enter(Phase::done);
}

ModelTuning::Output ModelTuning::sample(double celsius, double given_duty, double dt_s) {
    if (done()) return {};
    since_s_ += dt_s;
    at_rest_s_ += dt_s;
    if (phase_ == Phase::settle) return settle(celsius);
    if (phase_ == Phase::heat) return heat(celsius, dt_s);
    return hold(celsius, given_duty, dt_s);
}

ModelTuning::Output ModelTuning::settle(double celsius) {
    if (celsius > kWarmestRoom || std::abs(celsius - first_celsius_) > kRestCelsius) {
        first_celsius_ = celsius;
        at_rest_s_ = 0;
    }
    if (since_s_ > kSettleAtMostS) fail("it has not cooled to the room's temperature");
    if (at_rest_s_ < kRestS) return {};
    room_celsius_ = celsius;
    enter(Phase::heat);
    return {1, 0, true};
}

ModelTuning::Output ModelTuning::heat(double celsius, double dt_s) {
    const double rise = celsius - room_celsius_;
    integral_ += rise * dt_s;
    if (rise > kFitFrom * (target_ - room_celsius_)) fit_.add(since_s_, rise, integral_);
    if (since_s_ > kHeatAtMostS) fail("it has not reached the temperature within half an hour");
    if (celsius < target_) return {1, 0, true};
    const auto found = fit_.solve();
    if (!found) {
        fail("its readings do not rise as a heater's do");
        return {};
    }
    model_.heat_capacity_j_k = model_.power_w / found->rate;
    model_.loss_w_k = found->loss * model_.heat_capacity_j_k;
    model_.fan_loss_w_k = 0;
    model_.sensor_lag_s = std::clamp(found->lag_s, 0.2, 60.0);
    control_.emplace(model_);
    enter(Phase::rest);
    return {0, 0, true};
}

ModelTuning::Output ModelTuning::hold(double celsius, double given_duty, double dt_s) {
    const bool fan = phase_ == Phase::fan_rest || phase_ == Phase::fan_hold;
    const bool rests = phase_ == Phase::rest || phase_ == Phase::fan_rest;
    const double duty = control_->update({.celsius = celsius,
                                          .target_celsius = target_,
                                          .given_duty = given_duty,
                                          .dt_s = dt_s,
                                          .room_celsius = room_celsius_});
    const double phase_s = (rests ? kRestApproaches : kHoldApproaches) * approach_s(model_);
    if (!rests) {
        integral_ += given_duty * dt_s;
        mean_celsius_ += celsius * dt_s;
    }
    if (since_s_ >= phase_s) {
        if (rests) {
            first_celsius_ = celsius;
            enter(fan ? Phase::fan_hold : Phase::hold);
        } else {
            end_hold(celsius);
        }
    }
    return {done() ? 0 : duty, fan ? 1.0 : 0.0, true};
}

double ModelTuning::held_loss_w_k(double celsius) const {
    const double mean_w =
        (model_.power_w * integral_ - model_.heat_capacity_j_k * (celsius - first_celsius_)) / since_s_;
    return mean_w / (mean_celsius_ / since_s_ - room_celsius_);
}

void ModelTuning::end_hold(double celsius) {
    const double loss_w_k = held_loss_w_k(celsius);
    if (phase_ == Phase::fan_hold) {
        model_.fan_loss_w_k = std::max(loss_w_k - model_.loss_w_k, 0.0);
        return enter(Phase::done);
    }
    if (!(loss_w_k > 0)) return fail("it holds its temperature without power");
    model_.loss_w_k = loss_w_k;
    enter(with_fan_ ? Phase::fan_rest : Phase::done);
}

}  // namespace qduino::printer::heat
