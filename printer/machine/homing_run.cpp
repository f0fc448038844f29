// Carries out Homing's orders on the motion pipe. One order at a time: begun when everything before it has
// been played, ended by the switch (loop 2 saw it, loop 1 then has the rest dropped) or by the end of its
// move.
#include <cmath>
#include <cstdio>

#include "printer/machine/machine.h"

namespace qduino::printer::machine {

void Machine::advance_homing(Instant now) {
    if (stop_running_) return;
    if (!homing_.active()) {
        wait_ = Wait::nothing;
        return;
    }
    if (!homing_order_running_) {
        if (pipe_.drained() && places_.all_passed()) start_homing_order(now);
        return;
    }
    const Homing::Order order = homing_.order();
    const std::size_t axis = static_cast<std::size_t>(order.axis);
    if (order.step == Homing::Step::settle) {
        if (now < homing_settled_) return;
        settle_axis();
        homing_order_ended(true);
    } else if (order.step == Homing::Step::approach &&
               pipe_.seen().endstop_hits[axis] != homing_hits_before_) {
        pipe_.request_stop();  // the rest of the approach; finish_stop() goes on from there
        stop_running_ = true;
    } else if (pipe_.drained()) {
        homing_order_ended(order.step == Homing::Step::retreat);
    }
}

void Machine::start_homing_order(Instant now) {
    const Homing::Order order = homing_.order();
    const std::size_t axis = static_cast<std::size_t>(order.axis);
    homing_order_running_ = true;
    homing_hits_before_ = pipe_.seen().endstop_hits[axis];
    homing_steps_before_ = pipe_.seen().steps[axis];
    if (order.step == Homing::Step::settle) {
        homing_settled_ = now + from_seconds(kHomingRest_s);
        return;
    }
    motion::Planner& planner = pipe_.planner();
    motion::Move move;
    for (std::size_t i = 0; i < 3; ++i) move.end_mm[i] = planner.position_mm()[i];
    move.end_mm[axis] += order.distance_mm;
    move.speed_mm_s = order.speed_mm_s;
    move.acceleration_mm_s2 = acceleration_travel_;
    motors_.switch_motor(order.axis, motor_on_[axis] = true);
    const bool watched = order.step == Homing::Step::approach;
    // Everything before has been played, so the planner is empty and has room.
    QDUINO_EXPECT(!watched || planner.append_homing(order.axis, true));
    QDUINO_EXPECT(planner.append(move));
    QDUINO_EXPECT(!watched || planner.append_homing(order.axis, false));
    planner.flush();
}

void Machine::homing_order_ended(bool pressed) {
    homing_order_running_ = false;
    if (!homing_.active()) return;
    const Homing::Order order = homing_.order();
    const std::size_t axis = static_cast<std::size_t>(order.axis);
    const bool slow_approach =
        order.step == Homing::Step::approach && order.speed_mm_s < config_.axes[axis].home_speed.value();
    if (slow_approach && pressed) {
        const double travelled =
            static_cast<double>(std::abs(pipe_.seen().steps[axis] - homing_steps_before_)) /
            config_.axes[axis].steps_per_mm;
        if (travelled < 0.1 * config_.axes[axis].home_retreat.value()) {
            return homing_failed(
                "still reads pressed after moving away from it: check the switch and its wire");
        }
    }
    if (!homing_.done(pressed))
        return homing_failed("was not reached: check the switch, its wire and the motor");
    if (!homing_.active()) wait_ = Wait::nothing;
}

void Machine::homing_failed(const char* why) {
    const Axis axis = homing_.axis();
    homing_.abandon();
    homing_order_running_ = false;
    wait_ = Wait::nothing;
    forget_homed();
    if (*why != '\0') {
        char text[160];
        const std::size_t index = static_cast<std::size_t>(axis);
        std::snprintf(text, sizeof text, "%c endstop (pin %u) %s", kAxisLetter[index],
                      static_cast<unsigned>(config_.axes[index].endstop_pin), why);
        return enter_fault(text);
    }
    pipe_.request_stop();  // cancelled in the middle of it
    stop_running_ = true;
}

/// The axis rests on its switch: that is its home position, by definition.
void Machine::settle_axis() {
    const std::size_t axis = static_cast<std::size_t>(homing_.order().axis);
    motion::AxisVector position = pipe_.planner().position_mm();
    const double home_steps = config_.axes[axis].home_position.value() * config_.axes[axis].steps_per_mm;
    origin_[axis] = pipe_.seen().steps[axis] - std::llround(home_steps);
    position[axis] = config_.axes[axis].home_position.value();
    homed_[axis] = true;
    adopt_position(position);
}

}  // namespace qduino::printer::machine
