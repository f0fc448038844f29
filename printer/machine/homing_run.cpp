#include "printer/machine/homing_run.h"

namespace qduino::printer::machine {

void HomingRun::begin(gcode::AxisSet axes) {
    QDUINO_EXPECT(!axes.empty() && !axes.contains(Axis::e));
    homing_.begin(axes);
    running_.reset();
    forget(axes);
}

Result<bool> HomingRun::advance(Instant now, bool may_start) {
    if (!active() || pipe_.stops().running()) return false;
    if (!running_) {
        if (may_start) start(now);
        return false;
    }
    const Homing::Order order = homing_.order();
    if (order.phase == Homing::Phase::settle) {
        if (now < running_->began + from_seconds(kHomingRest_s)) return false;
        settle(order.axis);
        QDUINO_TRY(ended(true));
        return true;
    }
    const std::uint32_t hits = pipe_.seen().endstop_hits[order.axis];
    if (order.approaches() && hits != running_->hits) {
        pipe_.stops().ask();  // the rest of the approach; stopped() goes on from there
    } else if (pipe_.drained()) {
        QDUINO_TRY(ended(!order.approaches()));
    }
    return false;
}

void HomingRun::abandon() {
    homing_.abandon();
    running_.reset();
    homed_.fill(false);
}

void HomingRun::forget(gcode::AxisSet axes) {
    for (const Axis axis : gcode::kToolAxes)
        if (axes.contains(axis)) homed_[axis] = false;
}

void HomingRun::tell(gcode::Interpreter& interpreter) const {
    for (const Axis axis : gcode::kToolAxes) interpreter.set_homed(axis, homed(axis));
}

void HomingRun::start(Instant now) {
    const Homing::Order order = homing_.order();
    running_ = Running{now, pipe_.seen().endstop_hits[order.axis], pipe_.seen().steps[order.axis]};
    if (order.phase != Homing::Phase::settle) append(order);
}

/// Everything before has been played, so the planner is empty and has room.
void HomingRun::append(const Homing::Order& order) {
    motion::Planner& planner = pipe_.planner();
    motion::AxisVector end_mm = planner.position_mm();
    end_mm[order.axis] += order.distance_mm;
    motors_.on(order.axis);
    bool fits = !order.approaches() || planner.append_homing(order.axis, true);
    fits = planner.append_to(end_mm, order.speed_mm_s, pipe_.accelerations().travel) && fits;
    if (order.approaches()) fits = planner.append_homing(order.axis, false) && fits;
    QDUINO_EXPECT(fits);
    planner.flush();
}

Result<void> HomingRun::ended(bool pressed) {
    const Homing::Order order = homing_.order();
    const std::int64_t steps = pipe_.seen().steps[order.axis] - running_->steps;
    running_.reset();
    if (order.phase == Homing::Phase::slow_approach && pressed) {
        const double retreat_mm = config_.axes[order.axis].home_retreat.value();
        if (pipe_.scale().length_of(order.axis, steps) < 0.1 * retreat_mm) {
            return failed(order.axis,
                          "still reads pressed after moving away from it: check the switch and its wire");
        }
    }
    if (!homing_.done(pressed))
        return failed(order.axis, "was not reached: check the switch, its wire and the motor");
    return {};
}

/// The axis rests on its switch: that is its home position, by definition.
void HomingRun::settle(Axis axis) {
    const double home_mm = config_.axes[axis].home_position.value();
    pipe_.scale().define(axis, pipe_.seen().steps[axis], home_mm);
    motion::AxisVector position = pipe_.planner().position_mm();
    position[axis] = home_mm;
    pipe_.reset(position);
    homed_[axis] = true;
}

Error HomingRun::failed(Axis axis, std::string_view why) {
    abandon();
    return make_error(ErrorCode::faulted, kAxisLetter[axis], " endstop (pin ", config_.axes[axis].endstop_pin,
                      ") ", why);
}

}  // namespace qduino::printer::machine
