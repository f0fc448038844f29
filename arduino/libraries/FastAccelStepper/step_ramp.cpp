#include "arduino/libraries/FastAccelStepper/step_ramp.h"

#include <algorithm>
#include <cmath>

namespace qduino::arduino {

void StepRamp::stop() {
    const double steps = std::ceil(velocity_ * velocity_ / (2 * acceleration_));
    target_ = position_ + direction_ * static_cast<std::int64_t>(velocity_ > 0 ? steps : 0);
}

void StepRamp::halt() {
    velocity_ = 0;
    target_ = position_;
}

void StepRamp::set_position(std::int64_t position) {
    target_ += position - position_;
    position_ = position;
}

/// After the step that comes now, when so many are still behind it.
double StepRamp::next_velocity(double steps_behind) const {
    const double change = 2 * acceleration_, square = velocity_ * velocity_;
    const double slower = std::sqrt(std::max(0.0, square - change));
    const double wanted =
        velocity_ > speed_ ? std::max(speed_, slower) : std::min(speed_, std::sqrt(square + change));
    return std::max(slower, std::min(wanted, std::sqrt(change * std::max(0.0, steps_behind))));
}

/// How many seconds a step to the speed `after` takes: part of it at a constant acceleration, the
/// rest at the higher of both speeds. A step from rest to rest goes up for half of it, and down.
double StepRamp::duration_to(double after) const {
    const double slow = std::min(velocity_, after), fast = std::max(velocity_, after);
    if (fast == 0) return 2 / std::sqrt(acceleration_);
    const double changing = (fast * fast - slow * slow) / (2 * acceleration_);
    return std::max(0.0, 1 - changing) / fast + (fast - slow) / acceleration_;
}

std::optional<StepRamp::Step> StepRamp::next() {
    std::int64_t left = (target_ - position_) * direction_;
    if (left <= 0 && velocity_ * velocity_ <= 2 * acceleration_) velocity_ = 0;
    if (velocity_ == 0) {
        if (target_ == position_) return {};
        direction_ = target_ > position_ ? 1 : -1;
        left = std::abs(target_ - position_);
    }
    const double after = next_velocity(static_cast<double>(left - 1));
    const double seconds = duration_to(after);
    velocity_ = after;
    position_ += direction_;
    return Step{.direction = direction_, .seconds = seconds};
}

}  // namespace qduino::arduino
