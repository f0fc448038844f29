#include "spool/spool.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/words.h"
#include "spool/recovery.h"

namespace qduino::spool {

using printer::link::Command;
using printer::link::LinkLayout;
using printer::link::MachineState;
using printer::link::ReplyKind;

namespace {

constexpr Nanoseconds kRepeatCancelAfter = std::chrono::seconds{1};
constexpr std::string_view kHostHasPrinter = "a serial host has the printer";

std::string describe(const Job& job) { return text<std::string>("job ", job.id, " (", job.name, ")"); }

constexpr Words<CopyOutcome::completed, CopyOutcome::failed> kOutcomes{"completed", "cancelled", "failed"};

}  // namespace

// ---- emergency line -----------------------------------------------------------------------------

Result<void> EmergencyLine::stop() {
    const std::scoped_lock lock{mutex_};
    if (!link_) return make_error(ErrorCode::unavailable, "no machine is connected");
    link_->emergency.fetch_add(1, std::memory_order_release);
    return {};
}

void EmergencyLine::attach(LinkLayout* link) {
    const std::scoped_lock lock{mutex_};
    link_ = link;
}

// ---- start --------------------------------------------------------------------------------------

Spool::Spool(SpoolOptions options, LinkSource& link, Inspector* inspector)
    : options_(std::move(options)), link_(link), inspector_(inspector) {}

Result<std::unique_ptr<Spool>> Spool::open(SpoolOptions options, LinkSource& link, Inspector* inspector) {
    std::unique_ptr<Spool> spool{new Spool{std::move(options), link, inspector}};
    QDUINO_TRY(spool->load());
    return spool;
}

// ---- jobs ---------------------------------------------------------------------------------------

Result<void> Spool::commit(const Commit& commit) {
    QDUINO_TRY(store_->commit(commit));
    queue_.apply(commit.jobs);
    if (commit.gate) gate_ = *commit.gate;
    ++revision_;
    return {};
}

Result<void> Spool::commit_jobs(Result<Change> change) {
    if (!change) return change.error();
    return commit({.jobs = std::move(*change)});
}

Result<JobId> Spool::add(StagedFile& file, const Analysis& analysis, const NewJob& wanted,
                         UnixSeconds now_s) {
    Job job{.name = wanted.name,
            .size = file.size(),
            .sha256 = file.sha256(),
            .hold = wanted.hold,
            .copies = wanted.copies,
            .priority = wanted.priority,
            .created_s = now_s};
    spool::describe(job, analysis);
    const BlobCompanions companions{analysis.layers_json, analysis.thumbnail};
    job.stored_bytes = BlobStore::size_of(file.size(), file.layers_path(), companions);
    QDUINO_TRY_ASSIGN(Change change, queue_.plan_add(job));
    QDUINO_TRY(make_room(job.sha256, job.stored_bytes));
    const JobId id = change.put.front().id;
    QDUINO_TRY(blobs_->adopt(file, companions, {id, now_s, job.name}));
    if (const Result<void> committed = commit_jobs(std::move(change)); !committed) {
        drop_files(job);  // a file that is left is swept at the next start
        return committed.error();
    }
    blobs_->confirm(job.sha256);
    log("queued ", describe(*queue_.find(id)), ", ", job.size, " bytes");
    return id;
}

Result<Job> Spool::find_job(JobId id) const {
    if (const Job* live = queue_.find(id)) return *live;
    return store_->find(id);
}

std::optional<Job> Spool::find(JobId id) const {
    Result<Job> found = find_job(id);
    return found.ok() ? std::optional{std::move(*found)} : std::nullopt;
}

Result<void> Spool::patch(JobId id, const JobPatch& patch) {
    QDUINO_TRY_ASSIGN(Job job, find_job(id));
    return commit_jobs(queue_.plan_patch(std::move(job), patch));
}

Result<void> Spool::start(JobId id) {
    QDUINO_TRY_ASSIGN(Job job, find_job(id));
    return commit_jobs(queue_.plan_start(std::move(job)));
}

Result<void> Spool::remove(JobId id) {
    QDUINO_TRY_ASSIGN(const Job job, find_job(id));
    QDUINO_TRY(commit_jobs(queue_.plan_remove(job)));
    drop_files(job);
    log("deleted ", describe(job));
    return {};
}

// ---- the gates before a print -------------------------------------------------------------------

Result<void> Spool::hold_queue(std::string reason) {
    return commit({.gate = QueueGate{reason.empty() ? "held" : std::move(reason), gate_.bed_occupied}});
}

Result<void> Spool::release_queue() {
    if (host_has_printer_) {
        return make_error(ErrorCode::not_permitted, kHostHasPrinter, ": disconnect it first");
    }
    return commit({.gate = QueueGate{{}, gate_.bed_occupied}});
}

// ---- a serial host ------------------------------------------------------------------------------

Result<void> Spool::claim_for_host() {
    if (host_has_printer_) return {};
    if (run_ || awaited_report_) {
        const Job* job = run_ ? queue_.find(run_->job) : nullptr;
        return make_error(ErrorCode::not_permitted, "the printer is printing ",
                          job ? describe(*job) : "a job of its queue",
                          ": wait for its end, or cancel it on the page");
    }
    // Durable: a service that is killed now must not begin a job on what the host has printed.
    const std::string reason{gate_.hold_reason.empty() ? kHostHasPrinter : gate_.hold_reason};
    QDUINO_TRY(commit({.gate = QueueGate{reason, gate_.bed_occupied}}));
    QDUINO_TRY(push_command(Command::host_line, {}));
    host_has_printer_ = true;
    log(kHostHasPrinter, ": no job begins until it has gone");
    return {};
}

Result<void> Spool::host_line(std::string_view line, HostClaim claim) {
    QDUINO_TRY(check_connected());
    if (claim == HostClaim::printer) QDUINO_TRY(claim_for_host());
    return push_command(Command::host_line, line);
}

void Spool::host_leaves() {
    if (!std::exchange(host_has_printer_, false)) return;
    const bool ours = gate_.hold_reason == kHostHasPrinter;
    const std::string reason = !ours                  ? gate_.hold_reason
                               : options_.confirm_bed ? std::string{}
                                                      : "a serial host has used the printer";
    log("the serial host has gone");
    const bool occupied = options_.confirm_bed || gate_.bed_occupied;
    // If it fails, the queue stays held, and a person may release it.
    if (const Result<void> done = commit({.gate = QueueGate{reason, occupied}}); !done)
        log(done.error().message);
}

// ---- the machine --------------------------------------------------------------------------------

Result<void> Spool::check_connected() const {
    if (!machine_.connected) return make_error(ErrorCode::unavailable, "no machine is connected");
    if (machine_.life != SketchLife::alive) {
        return make_error(ErrorCode::unavailable, "the machine's program has died; start it anew");
    }
    if (!machine_.responding) return make_error(ErrorCode::unavailable, "the machine does not answer");
    return {};
}

Result<void> Spool::push_command(Command command, std::string_view text) {
    LinkLayout* link = link_.current();
    if (!link ||
        !try_push(link->commands, printer::link::encode(printer::link::CommandText{command, text}))) {
        return make_error(ErrorCode::unavailable, "the machine takes no more commands now; try again");
    }
    return {};
}

Result<void> Spool::pause() {
    QDUINO_TRY(check_connected());
    if (machine_.job.state == MachineState::printing) return push_command(Command::pause, {});
    const bool about_to_print = run_ && machine_.job.state == MachineState::idle;
    if (!about_to_print) return make_error(ErrorCode::not_permitted, "nothing is printing");
    pause_wanted_ = true;
    return {};
}

Result<void> Spool::resume() {
    QDUINO_TRY(check_connected());
    if (std::exchange(pause_wanted_, false)) return {};
    if (machine_.job.state != MachineState::paused && machine_.job.state != MachineState::pausing) {
        return make_error(ErrorCode::not_permitted, "nothing is paused");
    }
    return push_command(Command::resume, {});
}

Result<void> Spool::cancel() {
    if (!run_) {
        // A job that this journal does not know: its service is gone, and the machine still waits
        // for its bytes.
        const bool stray = machine_.connected && machine_.job.outcome == printer::link::JobOutcome::running;
        return stray ? push_command(Command::cancel, {})
                     : Result<void>{make_error(ErrorCode::not_permitted, "nothing is printing")};
    }
    Run changed = *run_;
    changed.cancel_asked = true;
    QDUINO_TRY(store_->commit({.run_changed = changed}));
    run_ = changed;
    cancel_sent_at_.reset();  // sent by the next tick, and again until it is obeyed
    return {};
}

Result<void> Spool::clear_fault() {
    QDUINO_TRY(check_connected());
    if (machine_.job.state != MachineState::faulted) {
        return make_error(ErrorCode::not_permitted, "the machine has no fault");
    }
    if (const auto persists = machine_.job.fault_persists.view(); !persists.empty()) {
        return make_error(ErrorCode::not_permitted, "the fault is still there: ", persists);
    }
    return push_command(Command::clear_fault, {});
}

Result<void> Spool::gcode(std::span<const std::string> lines) {
    QDUINO_TRY(check_connected());
    if (host_has_printer_) {
        return make_error(ErrorCode::not_permitted, kHostHasPrinter, ": its lines and yours would mix");
    }
    LinkLayout* link = link_.current();
    std::size_t needed = 0;
    for (const std::string& line : lines) {
        if (line.empty() || line.size() > 256 || line.find_first_of("\r\n") != std::string::npos) {
            return make_error(ErrorCode::invalid_argument, "a command is one line of 1 to 256 bytes");
        }
        needed += printer::link::kFrameHeaderBytes + 1 + line.size();
    }
    if (!link || link->commands.free() < needed) {
        return make_error(ErrorCode::unavailable, "the machine takes no more commands now; try again");
    }
    for (const std::string& line : lines) QDUINO_TRY(push_command(Command::gcode, line));
    return {};
}

std::string Spool::guarantee() {
    LinkLayout* link = link_.current();
    return link ? std::string{link->guarantee.read().json.view()} : std::string{};
}

// ---- time ---------------------------------------------------------------------------------------

void Spool::tick(Instant now, UnixSeconds now_s) {
    // Read before the machine: if the link was replaced, its sketch is gone, and the status read
    // now is its last word.
    const bool replaced = link_.is_replaced();
    LinkLayout* link = link_.current();
    machine_ = link ? read_machine(*link) : MachineView{};
    if (link) {
        link->service_heartbeat.fetch_add(1, std::memory_order_relaxed);
        watch_heartbeat(now);
        watch_death(now, replaced);
        read_replies();
    }
    if (run_) note_place();
    if (run_ && run_->inspected && inspector_) tell_typed_objects();
    if (run_) advance_run(now, now_s);
    if (awaited_report_) await_report();
    if (!replaced && may_begin()) {
        begin_next(now_s);
        if (run_) advance_run(now, now_s);
    }
    if (replaced) attach_link();
    keep_house(now, now_s);
}

/// Notes the place of the active run. The machine may be gone by the time the run has failed.
void Spool::note_place() {
    const auto& job = machine_.job;
    if (!machine_.connected || machine_.session != run_->session || job.job_id != run_->id) return;
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

void Spool::watch_heartbeat(Instant now) {
    if (machine_.job.heartbeat != heartbeat_ || heartbeat_at_ == Instant{}) heartbeat_at_ = now;
    heartbeat_ = machine_.job.heartbeat;
    machine_.responding = now - heartbeat_at_ < kSilentAfter;
}

/// A sketch that was started anew has its explanation already, or never gets one.
void Spool::watch_death(Instant now, bool replaced) {
    if (machine_.life == SketchLife::alive) return dead_since_.reset();
    if (!dead_since_) dead_since_ = now;
    machine_.may_be_explained =
        !replaced && machine_.death_note.empty() && now - *dead_since_ < kExplainedWithin;
}

/// A line that repeats (a full disk, say) is logged once.
void Spool::log_line(std::string line) {
    if (line == last_log_) return;
    last_log_ = line;
    log_.push_back(std::move(line));
}

void Spool::attach_link() {
    emergency_.attach(nullptr);
    host_leaves();
    feeder_.reset();
    link_.reopen();
    LinkLayout* link = link_.current();
    if (!link) return;
    // An earlier service may have written to these rings and read from them.
    link->jobs.adopt_writer();
    link->commands.adopt_writer();
    link->replies.adopt_reader();
    link->service_pid.store(static_cast<std::uint32_t>(::getpid()), std::memory_order_release);
    emergency_.attach(link);
    log("connected to the machine");
}

void Spool::read_replies() {
    LinkLayout* link = link_.current();
    // Bounded: a sketch that floods must not stop the tick.
    for (int frames = 0; frames < 256; ++frames) {
        const Result<std::optional<printer::link::FrameView>> frame = reply_reader_.read(link->replies);
        if (!frame.ok()) {
            log(frame.error().message);
            continue;
        }
        if (!frame->has_value()) return;
        const Result<printer::link::ReplyText> reply = printer::link::decode_reply((*frame)->payload);
        if ((*frame)->type != printer::link::FrameType::reply || !reply.ok()) continue;
        auto& replies = reply->kind >= ReplyKind::host_text ? host_replies_ : replies_;
        if (replies.size() < kRepliesHeld) replies.push_back({reply->kind, std::string{reply->text}});
    }
}

void Spool::advance_run(Instant now, UnixSeconds now_s) {
    const RunAction action = decide(*run_, machine_);
    switch (action.kind) {
        case RunAction::Kind::wait:
            return;
        case RunAction::Kind::begin:
        case RunAction::Kind::feed:
            return feed_run(action, now, now_s);
        case RunAction::Kind::completed:
            return finish_run(CopyOutcome::completed, {}, now_s);
        case RunAction::Kind::cancelled:
            return finish_run(CopyOutcome::cancelled, {}, now_s);
        case RunAction::Kind::failed:
            return finish_run(CopyOutcome::failed, action.reason, now_s);
    }
}

void Spool::feed_run(const RunAction& action, Instant now, UnixSeconds now_s) {
    const Job* job = queue_.find(run_->job);
    QDUINO_EXPECT(job != nullptr);
    const std::filesystem::path file = blobs_->path(job->sha256, BlobPart::gcode);
    const bool begin = action.kind == RunAction::Kind::begin;
    if (begin && inspector_ && run_->inspected && !inspector_->begun(run_->id)) {
        inspector_->begin(run_->id, file);
        return;
    }
    if (!feeder_) {
        Result<Feeder> opened = Feeder::open(file, run_->id, run_->length, job->estimated_s);
        if (!opened.ok()) {
            // The machine may hold a part of it, and has to let go before the run can end.
            if (begin)
                return finish_run(CopyOutcome::failed, std::string{opened.error().message.view()}, now_s);
            repeat_cancel(now);
            return;
        }
        feeder_.emplace(std::move(*opened));
    }
    LinkLayout& link = *link_.current();
    const Result<void> fed = begin ? feeder_->begin(link, now) : feeder_->feed(link, action.offset, now);
    if (!fed.ok() && !run_->cancel_asked) {
        log(fed.error().message);
        static_cast<void>(cancel());
    }
    if (run_->cancel_asked) repeat_cancel(now);
    const bool pauses_now = pause_wanted_ && machine_.job.state == MachineState::printing;
    if (pauses_now && push_command(Command::pause, {}).ok()) pause_wanted_ = false;
}

/// Repeated, because the machine refuses a cancellation that overtakes its job. Harmless: the next
/// run begins only when this one has ended and the command ring is empty.
void Spool::repeat_cancel(Instant now) {
    if (cancel_sent_at_ && now - *cancel_sent_at_ < kRepeatCancelAfter) return;
    if (push_command(Command::cancel, {}).ok()) cancel_sent_at_ = now;
}

void Spool::finish_run(CopyOutcome outcome, const std::string& reason, UnixSeconds now_s) {
    CopyEnd end = place_;
    end.outcome = outcome;
    end.error = reason;
    Result<Change> change = queue_.plan_end_copy(run_->job, end, now_s);
    QDUINO_EXPECT(change.ok());
    const Job job = change->put.front();
    Commit ending{.jobs = std::move(*change),
                  .run_ended = Commit::RunEnd{run_->id, std::string{kOutcomes(outcome)}, now_s},
                  .gate = gate_};
    if (outcome == CopyOutcome::failed && options_.hold_after_failure)
        ending.gate->hold_reason = text<std::string>(describe(job), " failed: ", reason);
    // A run that the machine never named has moved nothing. After any other, only a person can tell
    // whether the bed is clear.
    const bool untouched = outcome == CopyOutcome::failed && machine_.connected &&
                           machine_.life == SketchLife::alive && machine_.session == run_->session &&
                           machine_.job.job_id < run_->id;
    if (options_.confirm_bed && !untouched) ending.gate->bed_occupied = true;
    // Nothing is lost: the link still says how it ended, and the next tick tries again.
    if (const Result<void> done = commit(ending); !done) return log(done.error().message);
    log(describe(job), ' ', kOutcomes(outcome), reason.empty() ? "" : ": ", reason);
    if (run_->inspected) awaited_report_ = run_;
    run_.reset();
    feeder_.reset();
    cancel_sent_at_.reset();
    pause_wanted_ = false;
    place_ = {};
}

/// What was typed beside the run changes the part that is asked for. After a restart of this
/// service all that is held is told again, which changes nothing.
void Spool::tell_typed_objects() {
    const auto& job = machine_.job;
    if (!machine_.connected || machine_.session != run_->session || job.job_id != run_->id) return;
    const auto held = static_cast<std::uint32_t>(printer::link::kTypedObjects);
    if (job.typed_objects > held) typed_told_ = std::max(typed_told_, job.typed_objects - held);
    for (; typed_told_ < job.typed_objects; ++typed_told_) {
        const auto& typed = job.typed_object[typed_told_ % printer::link::kTypedObjects];
        inspector_->typed(run_->id, typed_told_, typed.behind_line, typed.left_mm,
                          std::string{typed.text.view()});
    }
}

void Spool::await_report() {
    std::optional<std::string> report = std::string{};
    if (inspector_) {
        const bool told = machine_.connected && machine_.job.job_id == awaited_report_->id;
        inspector_->end(awaited_report_->id, told ? machine_.job.excursions : 0);
        report = inspector_->report(awaited_report_->id);
    }
    if (!report) return;
    // If it fails, the next tick tries again.
    if (!commit({.report = std::pair{awaited_report_->id, std::move(*report)}})) return;
    awaited_report_.reset();
}

bool Spool::may_begin() {
    LinkLayout* link = link_.current();
    return link && !run_ && !awaited_report_ && !host_has_printer_ && gate_.hold_reason.empty() &&
           !gate_.bed_occupied && is_ready(machine_) && link->commands.empty() && queue_.next() != nullptr;
}

void Spool::begin_next(UnixSeconds now_s) {
    const Job* next = queue_.next();
    Result<Change> change = queue_.plan_begin_copy(next->id, now_s);
    QDUINO_EXPECT(change.ok());
    const Job job = *next;
    // Its number is higher than every number that this journal gave out, and every one that this
    // sketch has seen: the state folder may be a new one.
    const Run run{.id = std::max(last_run_id_, machine_.job.job_id) + 1,
                  .job = job.id,
                  .session = machine_.session,
                  .length = job.size,
                  .inspected = inspector_ != nullptr};
    if (const Result<void> done = commit({.jobs = std::move(*change), .run_begun = run}); !done)
        return log(done.error().message);
    log("printing ", describe(job), ", copy ", job.copies_done + 1, " of ", job.copies, ", run ", run.id);
    last_run_id_ = run.id;
    typed_told_ = 0;
    run_ = run;
    feeder_.reset();
    cancel_sent_at_.reset();
}

}  // namespace qduino::spool
