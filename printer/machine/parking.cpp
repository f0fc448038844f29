// Away from the path: where the head goes while a job is paused, and how it comes back.
//
//        stop ──retract──┐ hop                    lower ┌──un-retract── stop, to the step
//   path ═══●            │      park place              │            ●═══ path
//                        └────────► ● jogs … ● ─────────┘
//   state   pausing ......................│paused│ printing ............ printing
//   Away    no │ leaving                  │parked│ heating │ returning │ no
//
// The way out and back is planned and played like any other motion, by a planner of its own (MotionPipe::depart). X, Y and Z
// come back to the numbers at which the path was left, so to the same steps; that is checked on loop 2's counts. E
// counts on from where it left, whatever was pushed or drawn meanwhile.
//
// A rest on both ends of the way lets whoever sees nothing but pulses tell the way from the path (twin/inspector.h).
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>

#include "printer/machine/machine.h"

namespace qduino::printer::machine {

using link::MachineState;
using link::ReplyKind;

namespace {

constexpr double kRestAround_s = 0.1;
/// Nearer than this to where it must go back to, a detour makes sure that the last move is one.
constexpr double kDetour_mm = 0.1;

bool is_within(double mm, const AxisConfig& axis) {
    return mm >= axis.minimum.value() && mm <= axis.maximum.value();
}

/// `mm`, kept inside; a place that is outside already (an axis that was never homed) is no reason to move there.
double up_to(double from_mm, double mm, const AxisConfig& axis) {
    return std::max(from_mm, std::min(mm, axis.maximum.value()));
}

}  // namespace

// ---- away -------------------------------------------------------------------------------------------------------

/// The path is held and at rest: the head may go.
void Machine::leave_path() {
    keep_targets();
    pipe_.depart();
    left_ = Left{};
    left_.steps = pipe_.seen().steps;
    jog_interpreter_.reset_modes();
    jog_interpreter_.adopt_factors(interpreter_.state());
    for (Axis axis : gcode::kToolAxes)
        jog_interpreter_.set_homed(axis, homed_[static_cast<std::size_t>(axis)]);
    away_ = Away::leaving;
    plan_parking();
    left_.filament_mm = pipe_.planner().position_mm()[3];
}

void Machine::plan_parking() {
    const ParkConfig& park = config_.park;
    if (!park.enabled) return;
    if (!std::ranges::all_of(homed_, std::identity{})) {
        return reply(ReplyKind::warning,
                     "paused where the head stands: it parks only when all axes have been homed");
    }
    motion::Planner& planner = pipe_.planner();
    motion::AxisVector at = planner.position_mm();
    QDUINO_EXPECT(planner.append_dwell(kRestAround_s));
    const double needed = config_.minimum_extrude.value();
    const bool warm = heat_seen_.hot_end.reading && heat_seen_.hot_end.celsius >= needed;
    // What is drawn back must be pushed again: only if the hot end will be as warm then.
    if (warm && kept_targets_->hot_end.value() >= needed) {
        left_.retracted_mm = park.retract.value();
        at[3] -= park.retract.value();
        QDUINO_EXPECT(planner.append_to(at, park.retract_speed.value(), acceleration_filament_));
    }
    at[2] = up_to(at[2], at[2] + park.z_hop.value(), config_.axes[2]);
    QDUINO_EXPECT(planner.append_to(at, config_.axes[2].max_speed.value(), acceleration_travel_));
    at[0] = std::clamp(park.x, config_.axes[Axis::x].minimum, config_.axes[Axis::x].maximum).value();
    at[1] = std::clamp(park.y, config_.axes[Axis::y].minimum, config_.axes[Axis::y].maximum).value();
    QDUINO_EXPECT(planner.append_to(at, park.speed.value(), acceleration_travel_));
    switch_motors(pipe_.left_at_mm(), at);
    left_.parked = true;
}

void Machine::advance_excursion() {
    const bool goes_on = status_.state != MachineState::cancelling && status_.state != MachineState::faulted;
    if (away_ == Away::no || !goes_on || stop_running_) return;
    if (away_ == Away::leaving && pipe_.drained()) {
        stay_parked();
        if (resume_wanted_) begin_return();
    } else if (away_ == Away::heating && is_warm_again()) {
        away_ = Away::returning;
        plan_return();
    } else if (away_ == Away::returning && pipe_.drained()) {
        finish_return();
    }
}

/// Waits for a person here.
void Machine::stay_parked() {
    away_ = Away::parked;
    status_.state = MachineState::paused;
    const motion::AxisVector& at = pipe_.planner().position_mm();
    gcode::Position position;
    for (Axis axis : gcode::kAllAxes) position[axis] = Millimetres{at[static_cast<std::size_t>(axis)]};
    jog_interpreter_.set_position(position);
}

/// A jog by hand needs to know where the axis is; a line of a job is warned about instead (Interpreter).
Result<void> Machine::check_homed_for_jog(const gcode::Move& move) const {
    if (away_ == Away::no) return {};
    for (Axis axis : gcode::kToolAxes) {
        if (move.from[axis] == move.to[axis] || jog_interpreter_.homed(axis)) continue;
        FixedString<128> text;
        text.push_back(kAxisLetter[static_cast<std::size_t>(axis)])
            .append(" has not been homed: home first (it cannot be, while a job is paused)");
        return make_error(ErrorCode::unavailable, text);
    }
    return {};
}

// ---- back -------------------------------------------------------------------------------------------------------

void Machine::begin_return() {
    resume_wanted_ = false;
    pause_at_end_ = false;
    status_.state = MachineState::printing;
    away_ = Away::heating;
    targets_.hot_end = kept_targets_->hot_end;
    targets_.bed = kept_targets_->bed;
    ++targets_.requests;
    heat_.set_targets(targets_);
}

bool Machine::is_warm_again() const {
    const auto warm = [](const link::HeaterStatus& seen, Celsius target, const HeaterConfig& config) {
        return target.value() <= 0 || seen.celsius >= target.value() - config.at_target_celsius;
    };
    return pipe_.drained() && warm(heat_seen_.hot_end, targets_.hot_end, config_.hot_end) &&
           warm(heat_seen_.bed, targets_.bed, config_.bed);
}

void Machine::plan_return() {
    motion::Planner& planner = pipe_.planner();
    const motion::AxisVector& to = pipe_.left_at_mm();
    motion::AxisVector at = planner.position_mm();
    const double jogged_mm = at[3] - left_.filament_mm;
    const bool moved = at[0] != to[0] || at[1] != to[1] || at[2] != to[2];
    if (moved) {
        // A move of no length would be none, and might leave a step undone: a little to the side first.
        for (std::size_t i = 0; i < 3; ++i) {
            if (at[i] == to[i] || std::abs(at[i] - to[i]) >= kDetour_mm) continue;
            at[i] = is_within(to[i] + kDetour_mm, config_.axes[i]) ? to[i] + kDetour_mm : to[i] - kDetour_mm;
        }
        at[2] = std::max(at[2], up_to(to[2], to[2] + config_.park.z_hop.value(), config_.axes[2]));
        const double up_and_down = config_.axes[2].max_speed.value();
        QDUINO_EXPECT(planner.append_to(at, up_and_down, acceleration_travel_));
        at[0] = to[0];
        at[1] = to[1];
        QDUINO_EXPECT(planner.append_to(at, config_.park.speed.value(), acceleration_travel_));
        at[2] = to[2];
        QDUINO_EXPECT(planner.append_to(at, up_and_down, acceleration_travel_));
    }
    if (left_.retracted_mm > 0) {
        at[3] = to[3] + jogged_mm;
        QDUINO_EXPECT(planner.append_to(at, config_.park.retract_speed.value(), acceleration_filament_));
    }
    QDUINO_EXPECT(planner.append_dwell(kRestAround_s));
}

/// Back, and at rest: the path goes on at the step where it was left.
void Machine::finish_return() {
    const std::array<std::int64_t, kAxisCount>& steps = pipe_.seen().steps;
    for (std::size_t i = 0; i < 3; ++i) {
        if (steps[i] == left_.steps[i]) continue;
        char text[160];
        std::snprintf(text, sizeof text,
                      "%c came back from the pause %lld steps beside where it left: the print is stopped",
                      kAxisLetter[i], static_cast<long long>(steps[i] - left_.steps[i]));
        return enter_fault(text);
    }
    origin_[3] += steps[3] - left_.steps[3];
    ++status_.excursions;
    pipe_.come_back();
    away_ = Away::no;
    left_ = Left{};
    if (status_.state == MachineState::pausing)
        return;  // paused again on the way: it is still held, and leaves again
    kept_targets_.reset();
    pipe_.planner().resume();
}

/// The job is over, or the machine has a fault: there is no path to come back to.
void Machine::forget_excursion() {
    away_ = Away::no;
    left_ = Left{};
    resume_wanted_ = false;
    kept_targets_.reset();
}

// ---- heat -------------------------------------------------------------------------------------------------------

/// The targets that the job goes on with, once; what is set while it is paused changes them (note_request).
void Machine::keep_targets() {
    if (!kept_targets_) kept_targets_ = KeptTargets{targets_.hot_end, targets_.bed};
}

/// Somebody asked for a temperature. While paused: off means off for now; what is warm enough to go on with is taken over.
void Machine::note_request(gcode::Heater heater, Celsius target) {
    ++targets_.requests;
    if (!kept_targets_ || target.value() <= 0) return;
    if (heater == gcode::Heater::bed) {
        kept_targets_->bed = target;
        return;
    }
    const double needed = config_.minimum_extrude.value();
    if (target.value() >= needed || kept_targets_->hot_end.value() < needed) kept_targets_->hot_end = target;
}

/// Loop 3 has cut heaters that nobody used. A job that runs is paused before it moves on without heat.
void Machine::watch_idle() {
    const bool on = targets_.hot_end.value() > 0 || targets_.bed.value() > 0;
    if (!heat_seen_.idle_timed_out || heat_seen_.requests_seen != targets_.requests || !on) return;
    if (job_running()) keep_targets();
    targets_.hot_end = targets_.bed = Celsius{};
    heat_.set_targets(targets_);
    if (!job_running() && wait_ == Wait::temperature) wait_ = Wait::nothing;
    if (away_ == Away::heating) stay_parked();
    if (status_.state == MachineState::printing) {
        pause_at_end_ = false;
        status_.state = MachineState::pausing;
    }
    char text[160];
    std::snprintf(text, sizeof text, "nobody used the heaters for %.0f s: they are off%s",
                  heat_seen_.idle_timeout_s,
                  job_running() ? "; the job is paused, and heats up again first when it is resumed" : "");
    reply(ReplyKind::warning, text);
}

}  // namespace qduino::printer::machine
