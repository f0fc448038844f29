#include "spool/run.h"

#include <algorithm>

#include "base/contract.h"
#include "base/text.h"

namespace qduino::spool {

using printer::link::JobOutcome;
using printer::link::MachineState;

namespace {

RunAction failed(std::string reason) { return {RunAction::Kind::failed, 0, std::move(reason)}; }

RunAction decide_acknowledged(const Run& run, const MachineView& machine) {
    switch (machine.job.outcome) {
        case JobOutcome::completed:
            return {RunAction::Kind::completed, run.length, {}};
        case JobOutcome::cancelled:
            return {RunAction::Kind::cancelled, 0, {}};
        case JobOutcome::failed: {
            const std::string_view fault = machine.job.fault.view();
            return failed(fault.empty() ? std::string{"the machine stopped the job without giving a reason"}
                                        : std::string{fault});
        }
        case JobOutcome::none:
        case JobOutcome::running:
            break;
    }
    return {RunAction::Kind::feed, std::min(machine.job.bytes_accepted, run.length), {}};
}

}  // namespace

RunAction decide(const Run& run, const MachineView& machine) {
    QDUINO_EXPECT(run.id != 0);
    if (!machine.connected) return {};
    if (machine.session != run.session) {
        return failed("the machine's program was started anew while the job was printing");
    }
    // A reported outcome counts even if the sketch died after it.
    const bool acknowledged = machine.job.job_id == run.id;
    if (acknowledged) {
        RunAction action = decide_acknowledged(run, machine);
        if (action.kind != RunAction::Kind::feed) return action;
        if (machine.life == SketchLife::alive) return action;
    }
    if (machine.life != SketchLife::alive) {
        if (!machine.death_note.empty()) return failed(machine.death_note);
        if (machine.may_be_explained) return {};
        return failed(text<std::string>("the machine's program ",
                                        machine.life == SketchLife::hung ? "hung" : "died",
                                        " while the job was printing; the supervisor has switched it off"));
    }
    if (machine.job.job_id > run.id) return failed("the machine was given other jobs by another service");
    return {RunAction::Kind::begin, 0, {}};
}

bool is_ready(const MachineView& machine) {
    return machine.connected && machine.life == SketchLife::alive && machine.responding &&
           machine.job.state == MachineState::idle && machine.job.outcome != JobOutcome::running &&
           machine.job.job_id < kRunIdMax;
}

}  // namespace qduino::spool
