#include "spool/spool.h"

#include <utility>

namespace qduino::spool {

// ---- start --------------------------------------------------------------------------------------

Result<std::unique_ptr<Spool>> Spool::open(SpoolOptions options, std::unique_ptr<Storage> storage,
                                           LinkSource& link, Inspector* inspector) {
    std::unique_ptr<Spool> spool{new Spool{std::move(options), std::move(storage), link, inspector}};
    QDUINO_TRY(spool->load());
    return spool;
}

Result<void> Spool::load() {
    QDUINO_TRY_ASSIGN(StoredState state, storage_->load());
    if (!options_.confirm_bed) state.gate.bed_occupied = false;
    ledger_.load(std::move(state.jobs), state.next_job_id, state.last_ended, state.gate);
    house_.begin(state.newest_s);
    runs_.load(state);
    return {};
}

// ---- jobs ---------------------------------------------------------------------------------------

Result<JobId> Spool::add(StagedFile& file, const Analysis& analysis, const NewJob& wanted,
                         UnixSeconds now_s) {
    Job job{.name = wanted.name,
            .size = file.size(),
            .sha256 = file.sha256(),
            .hold = wanted.hold,
            .copies = wanted.copies,
            .priority = wanted.priority,
            .created_s = now_s};
    describe(job, analysis);
    const FileCompanions companions{analysis.layers_json, analysis.thumbnail};
    job.stored_bytes = stored_bytes_of(file, companions);
    QDUINO_TRY_ASSIGN(Change change, queue().plan_add(job));
    QDUINO_TRY(house_.make_room(job.sha256, job.stored_bytes));
    const JobId id = change.put.front().id;
    QDUINO_TRY(files().adopt(file, companions, {id, now_s, job.name}));
    if (const Result<void> committed = ledger_.commit(std::move(change)); !committed) {
        house_.drop_files(job);  // a file that is left is swept at the next start
        return committed.error();
    }
    files().confirm(job.sha256);
    ledger_.log().add("queued ", words_of(*queue().find(id)), ", ", job.size, " bytes");
    return id;
}

std::optional<Job> Spool::find(JobId id) const {
    Result<Job> found = ledger_.find(id);
    return found.ok() ? std::optional{std::move(*found)} : std::nullopt;
}

Result<void> Spool::patch(JobId id, const JobPatch& patch) {
    QDUINO_TRY_ASSIGN(Job job, ledger_.find(id));
    return ledger_.commit(queue().plan_patch(std::move(job), patch));
}

Result<void> Spool::start(JobId id) {
    QDUINO_TRY_ASSIGN(Job job, ledger_.find(id));
    return ledger_.commit(queue().plan_start(std::move(job)));
}

Result<void> Spool::remove(JobId id) {
    QDUINO_TRY_ASSIGN(const Job job, ledger_.find(id));
    QDUINO_TRY(ledger_.commit(queue().plan_remove(job)));
    house_.drop_files(job);
    ledger_.log().add("deleted ", words_of(job));
    return {};
}

// ---- the gates before a print -------------------------------------------------------------------

Result<void> Spool::release_queue() {
    if (host_.has_printer()) {
        return make_error(ErrorCode::not_permitted, HostKeeper::kHasPrinter, ": disconnect it first");
    }
    return ledger_.hold_queue({});
}

Result<void> Spool::gcode(std::span<const std::string> lines) {
    QDUINO_TRY(machine_.check_connected());
    if (host_.has_printer()) {
        return make_error(ErrorCode::not_permitted, HostKeeper::kHasPrinter,
                          ": its lines and yours would mix");
    }
    return machine_.push_lines(lines);
}

// ---- time ---------------------------------------------------------------------------------------

void Spool::tick(Instant now, UnixSeconds now_s) {
    machine_.read(now);
    runs_.tick(now, now_s, !machine_.is_replaced() && !host_.has_printer());
    if (machine_.is_replaced()) {
        machine_.detach();
        host_.leaves();
        runs_.forget_link();
        machine_.reopen();
    }
    house_.keep(now, now_s);
}

}  // namespace qduino::spool
