#include "apps/metal_printer/memory_spool.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "printer/facts/facts_json.h"
#include "printer/link/frame.h"
#include "printer/preflight/preflight.h"

namespace qduino::apps::metal {

using printer::link::Command;
using spool::CopyOutcome;
using spool::Job;
using spool::JobId;
using spool::RunAction;

namespace {

Error one_waits() {
    return make_error(ErrorCode::already_exists,
                      "a job waits already, and this printer has room for one: delete it first");
}

/// The facts, or what is wrong with the file.
Result<std::string> checked_facts(const printer::MachineConfig& machine, std::string_view bytes) {
    const auto preflight = std::make_unique<printer::preflight::Preflight>(machine);
    preflight->feed({bytes.data(), bytes.size()});
    const printer::preflight::Facts& facts = preflight->finish();
    if (facts.accepted() || facts.errors.empty())
        return printer::facts_json(facts, {}).dump(-1, ' ', false,
                                                   nlohmann::ordered_json::error_handler_t::replace);
    const bool is_gcode = facts.content == printer::gcode::Content::gcode;
    const printer::preflight::Finding& first = facts.errors[0];
    return make_error(is_gcode ? ErrorCode::out_of_range : ErrorCode::unsupported, "line ", first.line, ": ",
                      printer::sentence_of(first));
}

}  // namespace

Result<std::size_t> MemorySpool::Feed::read_at(std::uint64_t offset, std::span<std::uint8_t> bytes) {
    const std::size_t count = std::min<std::size_t>(bytes.size(), bytes_->size() - offset);
    std::memcpy(bytes.data(), bytes_->data() + offset, count);
    return count;
}

// ---- jobs ---------------------------------------------------------------------------------------

FileBytes MemorySpool::take_place() {
    if (FileBytes place = places_.take()) return place;
    forget_ended();
    return places_.take();
}

Result<JobId> MemorySpool::add(Uploaded upload) {
    if (is_waiting()) return one_waits();
    printer::MachineConfig machine = machine_config_;
    machine.step_cost = Nanoseconds{link_.step_cost_ns.load(std::memory_order_relaxed)};
    QDUINO_TRY_ASSIGN(std::string facts, checked_facts(machine, *upload.bytes));
    Job job;
    job.name = std::move(upload.name);
    job.size = upload.bytes->size();
    job.sha256 = std::move(upload.sha256);
    job.hold = !upload.print;
    job.facts_json = std::move(facts);
    QDUINO_TRY_ASSIGN(const spool::Change change, queue_.plan_add(job));
    const JobId id = change.put.front().id;
    bytes_[id] = std::move(upload.bytes);
    apply(change);
    return id;
}

Result<void> MemorySpool::start(JobId id) {
    const Job* const job = find(id);
    if (!job) return spool::no_such_job();
    if (spool::is_ended(job->state) && is_waiting()) return one_waits();
    QDUINO_TRY_ASSIGN(const spool::Change change, queue_.plan_start(*job));
    if (ended_ && ended_->id == id) ended_.reset();
    apply(change);
    return {};
}

Result<void> MemorySpool::remove(JobId id) {
    const Job* const job = find(id);
    if (!job) return spool::no_such_job();
    QDUINO_TRY_ASSIGN(const spool::Change change, queue_.plan_remove(*job));
    if (ended_ && ended_->id == id) ended_.reset();
    bytes_.erase(id);
    apply(change);
    return {};
}

void MemorySpool::apply(const spool::Change& change) {
    queue_.apply(change);
    for (const Job& job : change.put) {
        if (!spool::is_ended(job.state)) continue;
        forget_ended();
        ended_ = job;
    }
}

void MemorySpool::forget_ended() {
    if (ended_) bytes_.erase(ended_->id);
    ended_.reset();
}

std::vector<const Job*> MemorySpool::jobs() const {
    std::vector<const Job*> all = queue_.listing();
    if (ended_) all.push_back(&*ended_);
    return all;
}

const Job* MemorySpool::find(JobId id) const {
    for (const Job* const job : jobs()) {
        if (job->id == id) return job;
    }
    return nullptr;
}

// ---- the machine --------------------------------------------------------------------------------

Result<void> MemorySpool::send(Command command) {
    if (try_push(link_.commands, printer::link::encode(printer::link::CommandText{command, {}}))) return {};
    return make_error(ErrorCode::unavailable, "the machine takes no commands: it is busy");
}

Result<void> MemorySpool::cancel() {
    if (!run_) return make_error(ErrorCode::not_permitted, "no job prints");
    run_->cancel_asked = true;
    return {};
}

void MemorySpool::tick(Instant now) {
    machine_ = spool::read_machine(link_);
    if (run_) return go_on(now);
    if (!bed_occupied_ && queue_.next() != nullptr && spool::is_ready(machine_) && link_.commands.empty())
        begin_next();
}

void MemorySpool::begin_next() {
    const JobId id = queue_.next()->id;
    const Result<spool::Change> change = queue_.plan_begin_copy(id, 0);
    if (!change) return;
    apply(*change);
    run_ = spool::Run{.id = ++last_run_, .job = id, .session = machine_.session, .length = find(id)->size};
    feed_.emplace(bytes_.at(id), run_->id);
}

void MemorySpool::go_on(Instant now) {
    constexpr Nanoseconds kRepeatCancel = 500ms;  // it may have overtaken the job
    const RunAction action = spool::decide(*run_, machine_);
    switch (action.kind) {
        case RunAction::Kind::wait:
            return;
        case RunAction::Kind::begin:
            static_cast<void>(feed_->begin(link_, now));  // memory is always read
            break;
        case RunAction::Kind::feed:
            static_cast<void>(feed_->feed(link_, action.offset, now));
            break;
        case RunAction::Kind::completed:
            return end_run(CopyOutcome::completed, {});
        case RunAction::Kind::cancelled:
            return end_run(CopyOutcome::cancelled, {});
        case RunAction::Kind::failed:
            return end_run(CopyOutcome::failed, action.reason);
    }
    const bool again = !cancel_sent_ || now - *cancel_sent_ >= kRepeatCancel;
    if (run_->cancel_asked && again && send(Command::cancel)) cancel_sent_ = now;
}

void MemorySpool::end_run(CopyOutcome outcome, const std::string& reason) {
    const Result<spool::Change> change = queue_.plan_end_copy(run_->job, {outcome, reason, {}, {}}, 0);
    if (change) apply(*change);
    run_.reset();
    feed_.reset();
    cancel_sent_.reset();
    bed_occupied_ = true;
}

}  // namespace qduino::apps::metal
