// What the service asks for: pause, resume, cancel, clear a fault, and lines that a person typed.
#include <string_view>

#include "printer/machine/machine.h"

namespace qduino::printer::machine {

using link::Command;
using link::MachineState;
using link::ReplyKind;

void Machine::serve_commands() {
    for (int i = 0; i < kCommandsPerPlan; ++i) {
        const Result<std::optional<link::FrameView>> frame = command_reader_.read(link_.commands);
        if (!frame.ok()) {
            reply(ReplyKind::error, frame.error().message);
            continue;
        }
        if (!frame->has_value()) return;
        if ((*frame)->type != link::FrameType::command) continue;
        const Result<link::CommandText> command = link::decode_command((*frame)->payload);
        if (command.ok()) {
            serve(*command);
        } else {
            reply(ReplyKind::error, command.error().message);
        }
    }
}

void Machine::serve(const link::CommandText& command) {
    switch (command.command) {
        case Command::pause:
            return pause_job();
        case Command::resume:
            return resume_job();
        case Command::cancel:
            return cancel_job();
        case Command::clear_fault:
            return clear_fault();
        case Command::gcode:
            break;
    }
    if (command.text.size() > gcode::kCommandBytesMax) {
        return reply(ReplyKind::error, "the line is longer than 256 bytes: it was not taken");
    }
    if (!typed_.try_push_back(FixedString<gcode::kCommandBytesMax>{command.text})) {
        reply(ReplyKind::error, "busy: sixteen lines are waiting already; try again when they are done");
    }
}

void Machine::pause_job() {
    if (status_.state != MachineState::printing) return;
    status_.state = MachineState::pausing;
    pause_at_end_ = false;
    if (away_ == Away::heating) stay_parked();
}

void Machine::resume_job() {
    if (status_.state != MachineState::paused && status_.state != MachineState::pausing) return;
    // On its way to the park place, or without heat: that is finished first.
    const bool later = away_ == Away::leaving || (away_ == Away::no && kept_targets_);
    if (later) {
        resume_wanted_ = true;
        return;
    }
    if (away_ == Away::parked) return begin_return();
    if (away_ == Away::no && pipe_.planner().held()) pipe_.planner().resume();
    pause_at_end_ = false;
    status_.state = MachineState::printing;
}

void Machine::cancel_job() {
    const bool something =
        status_.state != MachineState::faulted && status_.state != MachineState::cancelling &&
        (status_.state != MachineState::idle || wait_ != Wait::nothing || !pipe_.drained());
    if (something) stop_job(link::JobOutcome::cancelled, "cancelled");
}

void Machine::clear_fault() {
    if (status_.state != MachineState::faulted || stop_running_) return;
    if (const auto persists = persisting_fault(); !persists.empty()) {
        FixedString<236> text{"the fault is still there: "};
        return reply(ReplyKind::error, text.append(persists));
    }
    heat_off();
    ++targets_.clear_faults;
    heat_.set_targets(targets_);
    heat_seen_.fault.clear();
    status_.fault.clear();
    status_.state = MachineState::idle;
    reply(ReplyKind::text, "fault cleared: home the axes before the next move");
}

/// What would fault again at once if the fault were cleared now; empty: nothing.
std::string_view Machine::persisting_fault() const {
    if (heat_silent_) return "the heater loop (loop 3) does not sample: restart the sketch";
    return heat_seen_.persists.view();
}

/// The code's own row says when it may be typed (gcode/command_table.h).
Result<void> Machine::may_type(const gcode::Command& command) const {
    using gcode::Typed;
    const bool faulted = status_.state == MachineState::faulted;
    const bool parked = away_ == Away::parked;
    const Typed needed = faulted          ? Typed::always
                         : !job_running() ? Typed::at_rest
                         : parked         ? Typed::parked
                                          : Typed::printing;
    if (gcode::may_be_typed(command.letter, command.number) >= needed) return {};
    FixedString<236> text{command.name().view()};
    text.append(faulted ? " was not done: the machine has a fault; clear it first"
                        : " was not done: a job runs; only temperatures, fan, M220, M221 and questions are "
                          "taken, and while it is paused jogs");
    return Error{ErrorCode::unavailable, text};
}

/// While a job runs or a fault is latched, what may be typed waits for nothing; while away it may be a jog, which needs room.
void Machine::answer_typed_lines() {
    const bool at_once = job_running() || status_.state == MachineState::faulted;
    const auto ready = [this] { return away_ == Away::no ? !interpreter_.pending() : pipe_.has_room(); };
    while (at_once && !typed_.empty() && ready()) run_typed_line();
}

void Machine::run_typed_line() {
    const FixedString<gcode::kCommandBytesMax> text = typed_.front();
    typed_.erase(0);
    const Result<std::optional<gcode::Command>> parsed = gcode::parse_line(text);
    if (!parsed.ok()) return reply(ReplyKind::error, parsed.error().message);
    if (!parsed->has_value()) return;
    Result<void> done = may_type(**parsed);
    if (done.ok()) {
        // Away from the path the job's interpreter stands still, with all its modes, where the path was read to.
        gcode::Interpreter& interpreter = away_ == Away::no ? interpreter_ : jog_interpreter_;
        from_console_ = true;
        done = interpreter.execute(**parsed, 4);
        from_console_ = false;
        if (away_ != Away::no) interpreter_.adopt_factors(jog_interpreter_.state());
    }
    if (done.ok()) {
        reply(ReplyKind::text, "ok");
    } else {
        reply(ReplyKind::error, done.error().message);
    }
}

}  // namespace qduino::printer::machine
