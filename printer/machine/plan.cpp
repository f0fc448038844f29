// Loop 1's release, in the order in which it happens.
#include <cmath>
#include <numeric>

#include "printer/machine/machine.h"

namespace qduino::printer::machine {

using link::JobOutcome;
using link::MachineState;

Machine::Machine(const MachineConfig& config, link::LinkLayout& link, MotorSwitch& motors)
    : config_(config),
      link_(link),
      motors_(motors),
      interpreter_(config_, *this),
      jog_interpreter_(config_, *this),
      heat_(config, link.heat_status),
      pipe_(config, link.emergency),
      homing_(config_),
      acceleration_print_(config.default_acceleration.value()),
      acceleration_travel_(config.travel_acceleration.value()),
      acceleration_filament_(config.default_acceleration.value()) {
    emergency_taken_.store(link.emergency.load(std::memory_order_acquire), std::memory_order_release);
    for (std::size_t i = 0; i < kAxisCount; ++i) {
        origin_[i] =
            -std::llround(config.axes[i].home_position.value() * (i < 3 ? config.axes[i].steps_per_mm : 0.0));
    }
}

heat::HeatDuties Machine::heat_sample(Instant now, const heat::HeatReadings& readings) {
    heat::HeatReadings seen = readings;
    const auto pulses = motion_for_heat_.read().pulses;
    seen.step_pulses = std::accumulate(pulses.begin(), pulses.end(), std::uint64_t{0});
    return heat_.sample(now, seen, emergency_pending());
}

void Machine::plan(Instant now) {
    pipe_.observe();
    if (!planned_before_) heat_alive_ = last_plan_ = now;
    planned_before_ = true;
    if (status_.state == MachineState::starting) status_.state = MachineState::idle;
    watch_emergency();
    watch_heat(now);
    watch_idle();
    pass_places();
    finish_stop();
    serve_commands();
    advance_wait(now);
    advance_hold();
    advance_excursion();
    answer_typed_lines();
    read_input();
    const bool reading = status_.state == MachineState::printing || status_.state == MachineState::idle;
    pipe_.pump(reading && away_ == Away::no && wait_ == Wait::nothing && !input_dry_);
    finish_job_when_played();
    publish(now);
}

void Machine::watch_emergency() {
    if (!emergency_pending()) return;
    enter_fault("emergency stop");
    emergency_taken_.store(link_.emergency.load(std::memory_order_acquire), std::memory_order_release);
}

void Machine::watch_heat(Instant now) {
    const link::HeatStatus seen = heat_.status();
    if (seen.heartbeat != heat_seen_.heartbeat) heat_alive_ = now;
    heat_seen_ = seen;
    heat_silent_ = now - heat_alive_ > kHeatSilence;
    if (status_.state == MachineState::faulted) return;
    if (!seen.fault.empty()) return enter_fault(seen.fault);
    if (heat_silent_)
        enter_fault("the heater loop (loop 3) has stopped sampling: heat is off; restart the sketch");
}

void Machine::pass_places() {
    if (pipe_.stopping() || stop_running_) return;
    places_.pass(pipe_.seen().last_marker, [this](const PlaceAction& action) { perform(action); });
}

/// Loop 2 has dropped everything: from its step counts the machine knows where it is.
void Machine::finish_stop() {
    if (!stop_running_ || pipe_.stopping()) return;
    stop_running_ = false;
    places_.forget();
    adopt_position(pipe_.position_of_pulses(origin_));
    if (homing_order_running_) homing_order_ended(true);
}

void Machine::adopt_position(const motion::AxisVector& position) {
    pipe_.reset(position);
    gcode::Position machine;
    for (Axis axis : gcode::kAllAxes) machine[axis] = Millimetres{position[static_cast<std::size_t>(axis)]};
    interpreter_.set_position(machine);
}

void Machine::advance_wait(Instant now) {
    if (wait_ == Wait::homing) return advance_homing(now);
    if (wait_ == Wait::temperature && temperature_reached(now)) wait_ = Wait::nothing;
}

bool Machine::temperature_reached(Instant now) {
    if (!places_.all_passed()) return false;  // the target is not in force before the moves are done
    const bool hot_end = wait_heater_ == gcode::Heater::hot_end;
    const HeaterConfig& config = hot_end ? config_.hot_end : config_.bed;
    const double celsius = hot_end ? heat_seen_.hot_end.celsius : heat_seen_.bed.celsius;
    const double target = wait_target_;
    const bool warm_enough = celsius >= target - config.at_target_celsius;
    const bool cool_enough =
        wait_direction_ == gcode::WaitFor::heating || celsius <= target + config.at_target_celsius;
    if (target <= 0 && wait_direction_ == gcode::WaitFor::heating) return true;
    if (!warm_enough || !cool_enough) {
        at_target_since_.reset();
        return false;
    }
    if (!at_target_since_) at_target_since_ = now;
    return to_seconds(now - *at_target_since_) >= config.at_target_time.value();
}

/// Pausing and cancelling: the motion comes to rest at the end of a move, then the state changes.
void Machine::advance_hold() {
    const bool pausing = status_.state == MachineState::pausing;
    const bool cancelling = status_.state == MachineState::cancelling;
    if ((!pausing && !cancelling) || wait_ == Wait::homing || stop_running_) return;
    if (pausing && away_ != Away::no) return;  // advance_excursion() says when
    motion::Planner& planner = pipe_.planner();
    if (pause_at_end_ && pausing && !pipe_.drained()) return;
    if (!planner.held()) planner.hold();
    if (!planner.stopped() || !pipe_.played_out()) return;
    if (pausing) return leave_path();
    planner.discard_held();
    places_.forget();
    adopt_position(planner.position_mm());
    end_job(stop_outcome_, stop_why_);
}

bool Machine::may_read() const {
    const bool state = status_.state == MachineState::idle || status_.state == MachineState::printing;
    return state && away_ == Away::no && wait_ == Wait::nothing && !stop_running_ && pipe_.has_room() &&
           !places_.full();
}

void Machine::read_input() {
    if (status_.state == MachineState::faulted) {
        // A job that arrives now is refused, not kept for later: nobody expects it to start after the repair.
        if (receiver_.receive(link_.jobs) == JobReceiver::Event::begun) {
            begin_job();
            end_job(JobOutcome::failed, status_.fault);
        }
        return;
    }
    for (int lines = 0; lines < kLinesPerPlan && may_read(); ++lines) {
        input_dry_ = !read_line();
        if (input_dry_) return;
    }
}

/// One line, from whoever has one. False: nothing to read now.
bool Machine::read_line() {
    if (interpreter_.pending()) {
        const Result<void> proceeded = interpreter_.proceed(4);
        if (!proceeded.ok()) stop_job(JobOutcome::failed, proceeded.error().message);
        return true;
    }
    if (!typed_.empty()) {
        run_typed_line();
        return true;
    }
    return read_job();
}

bool Machine::read_job() {
    if (input_complete_) return false;
    if (receiver_.held().empty()) {
        switch (receiver_.receive(link_.jobs)) {
            case JobReceiver::Event::none:
                return false;
            case JobReceiver::Event::begun:
                begin_job();
                return true;
            case JobReceiver::Event::ended:
                input_complete_ = true;
                if (const gcode::Line* last = parser_.finish()) on_job_line(*last);
                return true;
            case JobReceiver::Event::bytes:
                break;
        }
    }
    std::span<const char> bytes = gcode::as_chars(receiver_.held());
    const std::size_t before = bytes.size();
    const gcode::Line* line = parser_.next(bytes);
    receiver_.use(before - bytes.size());
    if (line) on_job_line(*line);
    return true;
}

void Machine::finish_job_when_played() {
    const bool done = status_.state == MachineState::printing && away_ == Away::no && input_complete_ &&
                      wait_ == Wait::nothing && !interpreter_.pending() && !stop_running_ &&
                      pipe_.drained() && places_.all_passed();
    if (!done) return;
    status_.bytes_executed = status_.job_length;
    end_job(JobOutcome::completed, {});
}

void Machine::publish(Instant now) {
    const bool counting = status_.state == MachineState::printing || status_.state == MachineState::pausing ||
                          status_.state == MachineState::cancelling;
    if (counting && job_running()) status_.print_time_s += to_seconds(now - last_plan_);
    last_plan_ = now;
    ++status_.heartbeat;
    if (job_running()) {
        status_.bytes_accepted = receiver_.accepted();
        status_.bytes_planned = parser_.offset();
    }
    status_.unknown_codes = interpreter_.unknown_codes();
    status_.warnings = interpreter_.warnings();
    for (Axis axis : gcode::kToolAxes) {
        const auto i = static_cast<std::size_t>(axis);
        status_.homed[i] = homed_[i] && !homing_.waits_for(axis);
    }
    status_.origin_steps = origin_;
    for (Axis axis : gcode::kAllAxes) {
        status_.position_mm[static_cast<std::size_t>(axis)] =
            shown_interpreter().programmed_position()[axis].value();
    }
    const bool paused = status_.state == MachineState::paused;
    status_.parked = paused && left_.parked;
    status_.may_jog = (paused && away_ == Away::parked) ||
                      (status_.state == MachineState::idle && !job_running() && wait_ == Wait::nothing);
    status_.fault_persists.assign(status_.state == MachineState::faulted ? persisting_fault()
                                                                         : std::string_view{});
    link_.job_status.write(status_);
}

}  // namespace qduino::printer::machine
