// Melt: what leaves the tip of the nozzle, from the extruder's microsteps and time.
//
// Filament and melt are springs. A push raises the pressure in the nozzle, and the pressure drives
// plastic out (Klipper, "Kinematics", pressure advance: the flow is proportional to the pressure).
// Take `stored` for the volume that has been pushed in and has not left. It is 0 when the melt just
// reaches the tip without pressure, and negative when a retraction has drawn it back:
//
//   d stored / dt = pushed − flow(stored)
//
//   flow ┤                  ╱  stored / pressure_s + idle flow      the pressure of pushes
//        │                ╱
//        │           _ ─ ╯     (stored + ooze) / idle_ooze_s       weight and heat: idle ooze
//        ┼─────────┴─────┴──────────────
//              −ooze     0      stored
//
// So a late step of X or Y, with the same flow, lays more where the head stands (the paper's
// ΔH = K δt, equation 3). A hot idle nozzle oozes. A retraction makes `stored` negative and ends
// the flow. Each of the three parts is a linear differential equation, which is solved exactly.
//
// The gear turns evenly from one microstep to the next: a microstep is pushed at the pace of the
// interval before it, in kPushAtMost at most.
//
// Invariants: pushed == left + Δstored + still to be pushed; the flow is never negative; advancing
// by a + b equals advancing by a, then b.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/contract.h"
#include "base/time.h"
#include "twin/machine.h"

namespace qduino::twin {

class Melt {
  public:
    /// A single microstep is pushed within this time.
    static constexpr Nanoseconds kPushAtMost{100'000'000};

    /// At rest: nothing flows. `step_mm3`: plastic in one microstep of the extruder.
    Melt(const MeltSpec& spec, double step_mm3)
        : spec_(spec), step_mm3_(step_mm3), stored_mm3_(-spec.idle_ooze_mm3) {
        QDUINO_EXPECT(spec.pressure_s > 0 && spec.idle_ooze_mm3 >= 0 && spec.idle_ooze_s > 0);
    }

    /// The extruder made a microstep at `now`, towards the nozzle (+1) or away from it (−1).
    void push(Instant now, int direction) {
        advance(now);
        const Nanoseconds interval = std::clamp(now - pushed_at_, Nanoseconds{1}, kPushAtMost);
        pushed_at_ = now;
        to_push_mm3_ += direction * step_mm3_;
        pace_mm3_s_ = to_push_mm3_ / to_seconds(interval);
    }

    /// A cold nozzle lets nothing through: what the gear turns then is ground off.
    void set_hot(Instant now, bool hot) {
        advance(now);
        hot_ = hot;
    }

    /// Plastic that has left the tip up to `now` since the last call, in mm³.
    [[nodiscard]] double take(Instant now) {
        advance(now);
        const double left = left_mm3_;
        left_mm3_ = 0;
        return left;
    }

    /// As of the last call of anything above.
    [[nodiscard]] double stored_mm3() const { return stored_mm3_; }
    /// What the gear has yet to push for the microsteps so far.
    [[nodiscard]] double to_push_mm3() const { return to_push_mm3_; }

  private:
    [[nodiscard]] double idle_flow() const { return spec_.idle_ooze_mm3 / spec_.idle_ooze_s; }
    [[nodiscard]] double flow() const {
        if (stored_mm3_ > 0) return stored_mm3_ / spec_.pressure_s + idle_flow();
        return std::max(stored_mm3_ + spec_.idle_ooze_mm3, 0.0) / spec_.idle_ooze_s;
    }

    void advance(Instant now) {
        if (now <= at_) return;
        double seconds = to_seconds(now - at_);
        at_ = now;
        if (!hot_) {
            to_push_mm3_ = pace_mm3_s_ = 0;
            return;
        }
        if (to_push_mm3_ != 0) {
            const double whole_s = to_push_mm3_ / pace_mm3_s_;
            const double pushing_s = std::min(seconds, whole_s);
            settle(pace_mm3_s_, pushing_s);
            to_push_mm3_ = whole_s <= seconds ? 0 : to_push_mm3_ - pace_mm3_s_ * pushing_s;
            seconds -= pushing_s;
        }
        settle(0, seconds);
    }

    /// `seconds` pass while `inflow` is pushed evenly, in mm³/s.
    void settle(double inflow, double seconds) {
        const double before = stored_mm3_;
        const double pushed = inflow * seconds;
        while (seconds > 0 && inflow != flow()) seconds -= follow_part(inflow, seconds);
        left_mm3_ += std::max(pushed - (stored_mm3_ - before), 0.0);
    }

    /// Goes along one of the three parts of the flow, to its end or for `seconds`, and returns the
    /// time that this took.
    double follow_part(double inflow, double seconds) {
        constexpr double kEndless = std::numeric_limits<double>::infinity();
        const bool rises = inflow > flow();
        const double ooze = spec_.idle_ooze_mm3;
        const auto above = [&](double edge) { return rises ? stored_mm3_ >= edge : stored_mm3_ > edge; };
        if (!above(-ooze)) {  // drawn back
            const double room_s = rises ? (-ooze - stored_mm3_) / inflow : kEndless;
            stored_mm3_ = room_s <= seconds ? -ooze : stored_mm3_ + inflow * seconds;
            return std::min(room_s, seconds);
        }
        const bool pressed = above(0);
        const double time_s = pressed ? spec_.pressure_s : spec_.idle_ooze_s;
        const double settled =
            pressed ? spec_.pressure_s * (inflow - idle_flow()) : spec_.idle_ooze_s * inflow - ooze;
        const double edge = pressed ? (rises ? kEndless : 0) : (rises ? 0 : -ooze);
        const double after = stored_mm3_ - (settled - stored_mm3_) * std::expm1(-seconds / time_s);
        if (rises ? after <= edge : after >= edge) {
            stored_mm3_ = after;
            return seconds;
        }
        const double passed_s = time_s * std::log((stored_mm3_ - settled) / (edge - settled));
        stored_mm3_ = edge;
        return passed_s;
    }

    MeltSpec spec_;
    double step_mm3_;
    double stored_mm3_;
    double to_push_mm3_ = 0;
    double pace_mm3_s_ = 0;
    double left_mm3_ = 0;
    bool hot_ = true;
    Instant at_{};
    Instant pushed_at_ = kEpoch - kPushAtMost;
};

}  // namespace qduino::twin
