#include "printer/machine/probe_run.h"

#include "printer/probe_grid.h"

namespace qduino::printer::machine {

void ProbeRun::begin() {
    QDUINO_EXPECT(config_.probe.pin != kNoPin);
    mesh_ = motion::BedMesh{config_.mesh};
    pipe_.correction().use_mesh(false);
    phase_ = Phase::over;
    running_ = false;
    point_ = 0;
}

Result<bool> ProbeRun::advance(bool may_start) {
    if (!active() || pipe_.stops().running()) return false;
    if (!running_) {
        if (may_start) start();
        return false;
    }
    if (phase_ == Phase::down && pipe_.seen().endstop_hits[step::kProbeSwitch] != hits_) {
        pipe_.stops().ask();  // the rest of the way down; stopped() goes on from there
        return false;
    }
    if (!pipe_.drained()) return false;
    running_ = false;
    if (phase_ == Phase::down) return failed("did not trigger on its way down");
    if (phase_ == Phase::over) {
        phase_ = Phase::down;
        return false;
    }
    phase_ = Phase::none;
    pipe_.correction().set_mesh(mesh_);
    pipe_.correction().use_mesh(true);
    return true;
}

/// Everything before has been played, so the planner is empty and has room.
void ProbeRun::start() {
    running_ = true;
    motion::Planner& planner = pipe_.planner();
    motion::AxisVector at = planner.position_mm();
    const double lift_speed = config_.axes[Axis::z].max_speed.value();
    if (phase_ == Phase::down) {
        hits_ = pipe_.seen().endstop_hits[step::kProbeSwitch];
        pulses_ = pipe_.seen().steps[Axis::z];
        const bool on = planner.append_homing(step::kProbeSwitch, kinematics_.motors_of(Axis::z));
        at[2] = config_.probe.trigger_height.value() - kTooLow_mm;
        go(at, config_.probe.speed.value());
        const bool off = planner.append_homing(step::kProbeSwitch, 0);
        QDUINO_EXPECT(on && off);
    } else {
        at[2] = config_.mesh.clearance.value();
        go(at, lift_speed);
        // The stop has left the nozzle on whole steps: also at the end it goes to the very place.
        const ProbePlace place = probe_place(config_, phase_ == Phase::over ? point_ : point_ - 1);
        at[0] = place.x.value();
        at[1] = place.y.value();
        go(at, config_.mesh.travel_speed.value());
        const bool fits = phase_ == Phase::over || planner.append_dwell(kRest_s);
        QDUINO_EXPECT(fits);
    }
    planner.flush();
}

void ProbeRun::go(const motion::AxisVector& to, double speed_mm_s) {
    motors_.on_for(pipe_.planner().position_mm(), to);
    const bool fits = pipe_.planner().append_to(to, speed_mm_s, pipe_.accelerations().travel);
    QDUINO_EXPECT(fits);
}

Result<void> ProbeRun::stopped() {
    if (phase_ != Phase::down || !running_) return {};
    running_ = false;
    if (pipe_.seen().steps[Axis::z] == pulses_) return failed("reads triggered before it has moved down");
    const ProbePlace place = probe_place(config_, point_);
    const double touch = pipe_.planner().position_mm()[2] - config_.probe.trigger_height.value();
    mesh_.set(place.column, place.row, touch);
    ++point_;
    phase_ = point_ < probe_count(config_.mesh) ? Phase::over : Phase::up;
    return {};
}

Error ProbeRun::failed(std::string_view why) {
    abandon();
    return make_error(ErrorCode::faulted, "the probe (pin ", config_.probe.pin, ") ", why,
                      ": check it and its wire");
}

}  // namespace qduino::printer::machine
