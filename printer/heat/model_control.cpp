#include "printer/heat/model_control.h"

namespace qduino::printer::heat {
namespace {

/// From here on the duty is at its upper stop.
constexpr double kFullDuty = 0.98;
constexpr double kLeastPower = 0.5;  // share of the power's number
constexpr double kMostPower = 1.6;
/// `extra_w` is bounded by this share of the power.
constexpr double kMostExtra = 0.6;
/// Further from its target a heater does not hold.
constexpr double kHoldingCelsius = 10;

}  // namespace

void ModelControl::correct(const Sample& sample) {
    const double lag = nominal_.sensor_lag_s;
    const double p = 1 / std::max(0.35 * lag, 0.45);
    const double r = 1 / (4 * approach_s(nominal_));
    const double error = (sample.celsius - state_->sensor_celsius) * sample.dt_s;
    state_->sensor_celsius += std::max(2 * p + r - 1 / lag, 0.0) * error;
    state_->block_celsius += lag * (p * p + 2 * p * r) * error;
    const double heat_w = nominal_.heat_capacity_j_k * lag * p * p * r * error;
    if (sample.target_celsius <= 0) {
        extra_w_ = 0;
    } else if (sample.given_duty >= kFullDuty) {
        model_.power_w = std::clamp(model_.power_w + heat_w, kLeastPower * nominal_.power_w,
                                    kMostPower * nominal_.power_w);
    } else if (sample.given_duty > 0 &&
               std::abs(sample.target_celsius - state_->block_celsius) < kHoldingCelsius) {
        const double most = kMostExtra * nominal_.power_w;
        extra_w_ = std::clamp(extra_w_ + heat_w, -most, most);
    }
}

double ModelControl::update(const Sample& sample) {
    HeaterDrive drive{sample.given_duty, sample.fan_duty, sample.flow_mm3_s, sample.room_celsius, extra_w_};
    if (!state_) state_ = HeaterState{sample.celsius, sample.celsius};
    state_ = after(model_, *state_, drive, sample.dt_s);
    correct(sample);
    if (sample.target_celsius <= 0) return 0;
    drive.extra_w = extra_w_;
    return duty_towards(model_, state_->block_celsius, sample.target_celsius, drive);
}

}  // namespace qduino::printer::heat
