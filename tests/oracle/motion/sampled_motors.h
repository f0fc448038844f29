// The motors of a machine, written down a second time and slowly: where each stands at any time.
//
//   nozzle(t) behind its filters ─► motor(t): inverse kinematics
//   (sampled_motion.h)              belts are sums; an arm is the long side of a triangle whose
//                                   angle at the carriage is asin(d/L)
//
// Nothing is shared with the solver, the motor paths or printer/kinematics.h.
#pragma once

#include <cmath>
#include <numbers>

#include "tests/oracle/motion/sampled_motion.h"

namespace qduino::test {

class SampledMotors {
  public:
    /// Both outlive this. `lead_s`: everything is played so much later than planned.
    SampledMotors(const SampledMotion& nozzle, const printer::MachineConfig& machine, Real lead_s)
        : nozzle_(nozzle), machine_(machine), lead_s_(lead_s) {}

    /// Microsteps from coordinate 0.
    [[nodiscard]] Real steps(std::size_t motor, Real at_s) const {
        const auto place = [&](std::size_t axis) { return nozzle_.position(axis, at_s - lead_s_); };
        return machine_.axes[motor].steps_per_mm * motor_mm(motor, place);
    }

  private:
    template <typename Place>
    [[nodiscard]] Real motor_mm(std::size_t motor, const Place& place) const {
        const printer::KinematicsConfig& k = machine_.kinematics;
        if (motor == 3 || k.type == printer::KinematicsType::cartesian) return place(motor);
        if (k.type == printer::KinematicsType::corexy)
            return motor == 0 ? place(0) + place(1) : motor == 1 ? place(0) - place(1) : place(2);
        const Real angle = static_cast<Real>(k.tower_angle_degrees[motor]) * std::numbers::pi_v<Real> / 180;
        const Real radius = k.delta_radius.value(), arm = k.arm_length.value();
        const Real sideways =
            std::hypot(place(0) - radius * std::cos(angle), place(1) - radius * std::sin(angle));
        return place(2) + arm * std::cos(std::asin(sideways / arm));
    }

    const SampledMotion& nozzle_;
    const printer::MachineConfig& machine_;
    Real lead_s_;
};

}  // namespace qduino::test
