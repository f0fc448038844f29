// How a job begins, what becomes of its lines, and the ways in which it ends.
#include "printer/machine/machine.h"

namespace qduino::printer::machine {

using link::JobOutcome;
using link::MachineState;

void Machine::begin_job() {
    parser_.reset();
    interpreter_.reset_modes();
    layers_ = {};
    input_complete_ = false;
    const MachineState state = status_.state;
    link::JobStatus fresh;
    fresh.heartbeat = status_.heartbeat;
    fresh.replies_dropped = status_.replies_dropped;
    fresh.fault = state == MachineState::faulted ? status_.fault : FixedString<236>{};
    fresh.state = state == MachineState::faulted ? state : MachineState::printing;
    fresh.outcome = JobOutcome::running;
    fresh.job_id = receiver_.job_id();
    fresh.job_length = receiver_.length();
    status_ = fresh;
}

void Machine::on_job_line(const gcode::Line& line) {
    if (!line.comment.empty()) on_comment(line.comment);
    if (line.error) return stop_job(JobOutcome::failed, line.error->message);
    if (!line.command) return;
    const Result<void> done = interpreter_.execute(*line.command, 4);
    if (!done.ok()) return stop_job(JobOutcome::failed, done.error().message);
}

void Machine::on_comment(std::string_view comment) {
    const gcode::Annotation annotation = gcode::parse_annotation(comment);
    if (annotation.kind == gcode::AnnotationKind::none) return;
    static_cast<void>(layers_.on_annotation(annotation));  // it is shown when its first move has been made
}

/// Ends the job where its motion can come to rest; end_job() follows when it has (advance_hold).
void Machine::stop_job(JobOutcome outcome, std::string_view why) {
    if (status_.state == MachineState::faulted || status_.state == MachineState::cancelling) return;
    stop_outcome_ = outcome;
    stop_why_.assign(why);
    wait_ = wait_ == Wait::homing ? wait_ : Wait::nothing;
    status_.state = MachineState::cancelling;
    typed_.clear();
    heat_off();
    if (wait_ == Wait::homing) homing_failed("");
}

void Machine::end_job(JobOutcome outcome, std::string_view why) {
    if (job_running()) {
        status_.outcome = outcome;
        status_.bytes_accepted = receiver_.accepted();
        if (outcome != JobOutcome::completed) status_.fault.assign(why);
        receiver_.close();
    }
    if (outcome == JobOutcome::failed) reply(link::ReplyKind::error, why);
    if (outcome != JobOutcome::completed) {
        heat_off();
        interpreter_.reset_modes();
        // What was read and will not be done, an M84 say, has changed nothing.
        for (Axis axis : gcode::kToolAxes)
            interpreter_.set_homed(axis, homed_[static_cast<std::size_t>(axis)]);
    }
    input_complete_ = false;
    pause_at_end_ = false;
    forget_excursion();
    wait_ = Wait::nothing;
    if (status_.state != MachineState::faulted) status_.state = MachineState::idle;
}

/// Heat off, motion dropped, job failed; nothing moves until clear_fault.
void Machine::enter_fault(std::string_view why) {
    heat_off();
    status_.fault.assign(why);
    status_.state = MachineState::faulted;
    typed_.clear();
    homing_.abandon();
    homing_order_running_ = false;
    forget_excursion();
    wait_ = Wait::nothing;
    pipe_.request_stop();
    stop_running_ = true;
    forget_homed();
    if (job_running()) {
        end_job(JobOutcome::failed, why);
    } else {
        reply(link::ReplyKind::error, why);
    }
}

void Machine::forget_homed() {
    homed_.fill(false);
    for (Axis axis : gcode::kToolAxes) interpreter_.set_homed(axis, false);
}

void Machine::heat_off() {
    targets_.hot_end = targets_.bed = Celsius{};
    targets_.fan_duty = 0;
    heat_.set_targets(targets_);
}

void Machine::reply(link::ReplyKind kind, std::string_view text) {
    if (!link::try_push(link_.replies, link::encode(link::ReplyText{kind, text}))) ++status_.replies_dropped;
}

}  // namespace qduino::printer::machine
