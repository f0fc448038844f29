#include "printer/machine/homing_run.h"

#include <algorithm>

namespace qduino::printer::machine {

void HomingRun::begin(gcode::AxisSet axes) {
    QDUINO_EXPECT(!axes.empty() && !axes.contains(Axis::e));
    homing_.begin(axes);
    // The place of the bed is another one now.
    if (axes.contains(Axis::z)) pipe_.correction().use_mesh(false);
    running_.reset();
    forget(axes);
}

Result<bool> HomingRun::advance(Instant now, bool may_start) {
    if (probe_.active()) return probe_.advance(may_start);
    if (!active() || pipe_.stops().running()) return false;
    if (!running_) {
        if (may_start) start(now);
        return false;
    }
    const Homing::Order order = homing_.order();
    if (order.phase == Homing::Phase::settle) {
        if (now < running_->began + from_seconds(kHomingRest_s)) return false;
        settle(order.switches);
        QDUINO_TRY(ended(true));
        return true;
    }
    if (order.approaches() && all_pressed(order)) {
        pipe_.stops().ask();  // the rest of the approach; stopped() goes on from there
    } else if (pipe_.drained()) {
        QDUINO_TRY(ended(!order.approaches()));
    }
    return false;
}

bool HomingRun::all_pressed(const Homing::Order& order) const {
    return std::ranges::none_of(gcode::kToolAxes, [&](Axis axis) {
        return order.switches.contains(axis) && pipe_.seen().endstop_hits[axis] == running_->hits[axis];
    });
}

void HomingRun::abandon() {
    homing_.abandon();
    probe_.abandon();
    running_.reset();
    homed_.fill(false);
}

void HomingRun::forget(gcode::AxisSet axes) {
    for (const Axis axis : gcode::kToolAxes)
        if (kinematics_.shares_motor(axis, axes)) homed_[axis] = false;
}

void HomingRun::tell(gcode::Interpreter& interpreter) const {
    for (const Axis axis : gcode::kToolAxes) interpreter.set_homed(axis, homed(axis));
}

void HomingRun::start(Instant now) {
    const Homing::Order order = homing_.order();
    running_ = Running{now, pipe_.seen().endstop_hits, pipe_.seen().steps};
    if (order.phase != Homing::Phase::settle) append(order);
}

/// Everything before has been played, so the planner is empty and has room.
void HomingRun::append(const Homing::Order& order) {
    motion::Planner& planner = pipe_.planner();
    motion::AxisVector end_mm = planner.position_mm();
    end_mm[order.axis] += order.distance_mm;
    motors_.on(order.axis);
    bool fits = !order.approaches() || watch(order, true);
    fits = planner.append_to(end_mm, order.speed_mm_s, pipe_.accelerations().travel) && fits;
    if (order.approaches()) fits = watch(order, false) && fits;
    QDUINO_EXPECT(fits);
    planner.flush();
}

bool HomingRun::watch(const Homing::Order& order, bool on) {
    return std::ranges::all_of(gcode::kToolAxes, [&](Axis axis) {
        return !order.switches.contains(axis) ||
               pipe_.planner().append_homing(axis, on ? kinematics_.stopped_by(axis) : 0);
    });
}

void HomingRun::locate() {
    if (!running_ || !kinematics_.homes_together() || !homing_.order().approaches()) return;
    if (all_pressed(homing_.order())) stand_at_home(homing_.order().switches);
}

Result<void> HomingRun::ended(bool pressed) {
    const Homing::Order order = homing_.order();
    const Running ran = *running_;
    running_.reset();
    if (order.phase == Homing::Phase::slow_approach && pressed) {
        for (const Axis axis : gcode::kToolAxes) {
            if (!order.switches.contains(axis)) continue;
            const double moved_mm = pipe_.scale().length_of(axis, pipe_.seen().steps[axis] - ran.steps[axis]);
            if (moved_mm >= 0.1 * config_.axes[order.axis].home_retreat.value()) continue;
            return failed(axis,
                          "still reads pressed after moving away from it: check the switch and its wire");
        }
    }
    if (homing_.done(pressed)) return {};
    const auto* const missed = std::ranges::find_if(gcode::kToolAxes, [&](Axis axis) {
        return order.switches.contains(axis) && pipe_.seen().endstop_hits[axis] == ran.hits[axis];
    });
    return failed(missed != gcode::kToolAxes.end() ? *missed : order.axis,
                  "was not reached: check the switch, its wire and the motor");
}

/// The axes rest on their switches: that is their home position, by definition.
motion::AxisVector HomingRun::stand_at_home(gcode::AxisSet axes) {
    motion::AxisVector position = pipe_.planner().position_mm();
    for (const Axis axis : gcode::kToolAxes)
        if (axes.contains(axis)) position[axis] = config_.axes[axis].home_position.value();
    pipe_.scale().define(axes, pipe_.seen().steps, position);
    return position;
}

void HomingRun::settle(gcode::AxisSet axes) {
    pipe_.reset(stand_at_home(axes));
    for (const Axis axis : gcode::kToolAxes) homed_[axis] = homed_[axis] || axes.contains(axis);
}

Error HomingRun::failed(Axis axis, std::string_view why) {
    abandon();
    return make_error(ErrorCode::faulted, kAxisLetter[axis], " endstop (pin ", config_.axes[axis].endstop_pin,
                      ") ", why);
}

}  // namespace qduino::printer::machine
