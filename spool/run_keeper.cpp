#include "spool/run_keeper.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/words.h"

namespace qduino::spool {

using printer::link::Command;
using printer::link::MachineState;

namespace {

constexpr Nanoseconds kRepeatCancelAfter = std::chrono::seconds{1};
constexpr Words<CopyOutcome::completed, CopyOutcome::failed> kOutcomes{"completed", "cancelled", "failed"};

}  // namespace

void RunKeeper::load(const StoredState& state) {
    run_ = state.active_run;
    awaited_report_ = state.awaited_report;
    last_run_id_ = state.last_run_id;
    if (run_) ledger_.log().add("carrying on with run ", run_->id, " of job ", run_->job);
}

// ---- what a person asks for ---------------------------------------------------------------------

Result<void> RunKeeper::pause() {
    QDUINO_TRY(machine_.check_connected());
    const MachineState state = machine_.view().job.state;
    if (state == MachineState::printing) return machine_.push(Command::pause);
    const bool about_to_print = run_ && state == MachineState::idle;
    if (!about_to_print) return make_error(ErrorCode::not_permitted, "nothing is printing");
    pause_wanted_ = true;
    return {};
}

Result<void> RunKeeper::resume() {
    QDUINO_TRY(machine_.check_connected());
    if (std::exchange(pause_wanted_, false)) return {};
    const MachineState state = machine_.view().job.state;
    if (state != MachineState::paused && state != MachineState::pausing) {
        return make_error(ErrorCode::not_permitted, "nothing is paused");
    }
    return machine_.push(Command::resume);
}

Result<void> RunKeeper::cancel() {
    if (!run_) {
        // A job that this journal does not know: its service is gone, and the machine still waits
        // for its bytes.
        const MachineView& machine = machine_.view();
        const bool stray = machine.connected && machine.job.outcome == printer::link::JobOutcome::running;
        return stray ? machine_.push(Command::cancel)
                     : Result<void>{make_error(ErrorCode::not_permitted, "nothing is printing")};
    }
    Run changed = *run_;
    changed.cancel_asked = true;
    QDUINO_TRY(ledger_.store().commit({.run_changed = changed}));
    run_ = changed;
    cancel_sent_at_.reset();  // sent by the next tick, and again until it is obeyed
    return {};
}

// ---- time ---------------------------------------------------------------------------------------

void RunKeeper::tick(Instant now, UnixSeconds now_s, bool may_begin) {
    if (run_) note_place();
    if (run_ && run_->inspected && inspector_) tell_typed_objects();
    if (run_) advance(now, now_s);
    if (awaited_report_) await_report();
    if (!may_begin || !is_next_due()) return;
    begin_next(now_s);
    if (run_) advance(now, now_s);
}

/// Notes the place of the active run. The machine may be gone by the time the run has failed.
void RunKeeper::note_place() {
    if (!machine_.speaks_of(*run_)) return;
    const auto& job = machine_.view().job;
    const auto whole = [](std::uint64_t value) {
        return static_cast<std::int64_t>(
            std::min<std::uint64_t>(value, std::numeric_limits<std::int64_t>::max()));
    };
    constexpr double kLongest_s = 1e9;
    if (job.print_time_s >= 0 && job.print_time_s < kLongest_s)  // not so for a damaged page's
        place_.printed_s = std::llround(job.print_time_s);
    place_.stopped_byte = whole(job.bytes_executed);
    if (job.line == 0) return;
    place_.stopped_line = whole(job.line);
    place_.stopped_layer = job.layer;
}

/// What was typed beside the run changes the part that is asked for. After a restart of this
/// service all that is held is told again, which changes nothing.
void RunKeeper::tell_typed_objects() {
    if (!machine_.speaks_of(*run_)) return;
    const auto& job = machine_.view().job;
    const auto held = static_cast<std::uint32_t>(printer::link::kTypedObjects);
    if (job.typed_objects > held) typed_told_ = std::max(typed_told_, job.typed_objects - held);
    for (; typed_told_ < job.typed_objects; ++typed_told_) {
        const auto& typed = job.typed_object[typed_told_ % printer::link::kTypedObjects];
        inspector_->typed(run_->id, typed_told_, typed.behind_line, typed.left_mm,
                          std::string{typed.text.view()});
    }
}

void RunKeeper::advance(Instant now, UnixSeconds now_s) {
    const RunAction action = decide(*run_, machine_.view());
    switch (action.kind) {
        case RunAction::Kind::wait:
            return;
        case RunAction::Kind::begin:
        case RunAction::Kind::feed:
            return feed(action, now, now_s);
        case RunAction::Kind::completed:
            return finish(CopyOutcome::completed, {}, now_s);
        case RunAction::Kind::cancelled:
            return finish(CopyOutcome::cancelled, {}, now_s);
        case RunAction::Kind::failed:
            return finish(CopyOutcome::failed, action.reason, now_s);
    }
}

void RunKeeper::feed(const RunAction& action, Instant now, UnixSeconds now_s) {
    const Job* job = ledger_.queue().find(run_->job);
    QDUINO_EXPECT(job != nullptr);
    const bool begin = action.kind == RunAction::Kind::begin;
    if (begin && inspector_ && run_->inspected && !inspector_->begun(run_->id)) {
        inspector_->begin(run_->id, ledger_.files().place_of(job->sha256));
        return;
    }
    if (!feeder_) {
        auto bytes = ledger_.files().content(job->sha256, FilePart::gcode);
        if (!bytes || bytes->size() != run_->length) {
            const char* const why = bytes ? "the job's file has not the length that was uploaded"
                                          : "the job's file cannot be opened";
            // The machine may hold a part of it, and has to let go before the run can end.
            if (begin) return finish(CopyOutcome::failed, why, now_s);
            repeat_cancel(now);
            return;
        }
        feeder_.emplace(std::move(bytes), run_->id, job->estimated_s);
    }
    printer::link::LinkLayout& link = *machine_.layout();
    const Result<void> fed = begin ? feeder_->begin(link, now) : feeder_->feed(link, action.offset, now);
    if (!fed.ok() && !run_->cancel_asked) {
        ledger_.log().add(fed.error().message);
        static_cast<void>(cancel());
    }
    if (run_->cancel_asked) repeat_cancel(now);
    const bool pauses_now = pause_wanted_ && machine_.view().job.state == MachineState::printing;
    if (pauses_now && machine_.push(Command::pause).ok()) pause_wanted_ = false;
}

/// Repeated, because the machine refuses a cancellation that overtakes its job. Harmless: the next
/// run begins only when this one has ended and the command ring is empty.
void RunKeeper::repeat_cancel(Instant now) {
    if (cancel_sent_at_ && now - *cancel_sent_at_ < kRepeatCancelAfter) return;
    if (machine_.push(Command::cancel).ok()) cancel_sent_at_ = now;
}

void RunKeeper::finish(CopyOutcome outcome, const std::string& reason, UnixSeconds now_s) {
    CopyEnd end = place_;
    end.outcome = outcome;
    end.error = reason;
    Result<Change> change = ledger_.queue().plan_end_copy(run_->job, end, now_s);
    QDUINO_EXPECT(change.ok());
    const Job job = change->put.front();
    Commit ending{.jobs = std::move(*change),
                  .run_ended = Commit::RunEnd{run_->id, std::string{kOutcomes(outcome)}, now_s},
                  .gate = ledger_.gate()};
    if (outcome == CopyOutcome::failed && options_.hold_after_failure)
        ending.gate->hold_reason = text<std::string>(words_of(job), " failed: ", reason);
    // A run that the machine never named has moved nothing. After any other, only a person can tell
    // whether the bed is clear.
    const MachineView& machine = machine_.view();
    const bool untouched = outcome == CopyOutcome::failed && machine.connected &&
                           machine.life == SketchLife::alive && machine.session == run_->session &&
                           machine.job.job_id < run_->id;
    if (options_.confirm_bed && !untouched) ending.gate->bed_occupied = true;
    // Nothing is lost: the link still says how it ended, and the next tick tries again.
    if (!ledger_.try_commit(ending)) return;
    ledger_.log().add(words_of(job), ' ', kOutcomes(outcome), reason.empty() ? "" : ": ", reason);
    if (run_->inspected) awaited_report_ = run_;
    run_.reset();
    feeder_.reset();
    cancel_sent_at_.reset();
    pause_wanted_ = false;
    place_ = {};
}

void RunKeeper::await_report() {
    std::optional<std::string> report = std::string{};
    if (inspector_) {
        const MachineView& machine = machine_.view();
        const bool told = machine.connected && machine.job.job_id == awaited_report_->id;
        inspector_->end(awaited_report_->id, told ? machine.job.excursions : 0);
        report = inspector_->report(awaited_report_->id);
    }
    if (!report) return;
    // If it fails, the next tick tries again.
    if (!ledger_.commit(Commit{.report = std::pair{awaited_report_->id, std::move(*report)}})) return;
    awaited_report_.reset();
}

bool RunKeeper::is_next_due() {
    const printer::link::LinkLayout* link = machine_.layout();
    const QueueGate& gate = ledger_.gate();
    return link && !busy() && gate.hold_reason.empty() && !gate.bed_occupied && is_ready(machine_.view()) &&
           link->commands.empty() && ledger_.queue().next() != nullptr;
}

void RunKeeper::begin_next(UnixSeconds now_s) {
    const Job job = *ledger_.queue().next();
    Result<Change> change = ledger_.queue().plan_begin_copy(job.id, now_s);
    QDUINO_EXPECT(change.ok());
    // Its number is higher than every number that this journal gave out, and every one that this
    // sketch has seen: the state folder may be a new one.
    const MachineView& machine = machine_.view();
    const Run run{.id = std::max(last_run_id_, machine.job.job_id) + 1,
                  .job = job.id,
                  .session = machine.session,
                  .length = job.size,
                  .inspected = inspector_ != nullptr};
    if (!ledger_.try_commit({.jobs = std::move(*change), .run_begun = run})) return;
    ledger_.log().add("printing ", words_of(job), ", copy ", job.copies_done + 1, " of ", job.copies,
                      ", run ", run.id);
    last_run_id_ = run.id;
    typed_told_ = 0;
    run_ = run;
    feeder_.reset();
    cancel_sent_at_.reset();
}

}  // namespace qduino::spool
