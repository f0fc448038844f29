#include "spool/housekeeping.h"

#include <algorithm>
#include <limits>

#include "spool/recovery.h"

namespace qduino::spool {

namespace {

constexpr int kSweptEachTick = 64;
constexpr std::size_t kErasedEachTick = 16;
constexpr UnixSeconds kAgesEvery_s = 60;
constexpr UnixSeconds kDay_s = 24 * 60 * 60;

std::string files_set_aside(std::size_t count) {
    return text<std::string>(count, count == 1 ? " stored file is" : " stored files are",
                             " set aside that the job journal does not know: stop the service and run printd "
                             "--recover to have their jobs again");
}

}  // namespace

// ---- start and end ------------------------------------------------------------------------------

Result<StoredState> Housekeeping::open() {
    QDUINO_TRY_ASSIGN(blobs_, BlobStore::open(options_.folder, options_.limits));
    QDUINO_TRY_ASSIGN(StoredState state, load_journal());
    first_new_id_ = state.next_job_id;
    return state;
}

/// Opens the journal, checks that it is sound and the one that the blobs belong to, and loads it.
Result<StoredState> Housekeeping::load_journal() {
    if (options_.journal_in_memory) {
        QDUINO_TRY_ASSIGN(std::unique_ptr<Store> store, Store::open(":memory:"));
        ledger_.open(std::move(store));
        return ledger_.store().load();
    }
    QDUINO_TRY_ASSIGN(OpenedJournal journal, open_journal(options_.folder, options_.opened_s));
    ledger_.open(std::move(journal.store));
    Store& store = ledger_.store();
    ballast_ = std::make_unique<Ballast>(options_.folder);
    store.when_full([this] {
        const bool given = ballast_->give_up();
        if (given)
            ledger_.log().add(
                "the disk is full: the room that was kept for this is used; uploads are refused");
        return given;
    });
    const Result<UnixSeconds> newest = store.newest_time();
    clock_ = ClockWatch{options_.calendar_from_s, newest ? *newest : 0};
    copier_ = std::make_unique<JournalCopier>(options_.folder);
    if (!journal.repaired.empty())
        ledger_.log().add("the job journal was damaged, and is repaired from its copy: ", journal.repaired);
    QDUINO_TRY_ASSIGN(StoredState state, store.load());
    const std::string known = blobs_->journal_id();
    // An older program wrote no id. A journal of such a program that has jobs is the blobs' own.
    const bool of_an_older_program = known.empty() && store.counts().total() > 0;
    if (state.rebuilding) {
        QDUINO_TRY(rebuild());
        QDUINO_TRY_ASSIGN(state, store.load());
    } else if (known != state.journal_id && !of_an_older_program) {
        ledger_.set_gate(state.gate);
        QDUINO_TRY(set_strangers_aside());
        state.gate = ledger_.gate();
    } else if (const std::size_t count = blobs_->all_set_aside().size(); count > 0) {
        ledger_.log().add(files_set_aside(count));
    }
    std::error_code failed;
    sweep_ = std::filesystem::directory_iterator{blobs_->blobs_folder(), failed};
    if (known != state.journal_id) QDUINO_TRY(blobs_->set_journal_id(state.journal_id));
    return state;
}

Result<void> Housekeeping::rebuild() {
    const auto said = [this](std::size_t done, std::size_t total, const std::string& words) {
        if (done == total || done % 100 == 0)
            ledger_.log().add("stored files: ", done, " of ", total, " looked at; ", words);
    };
    QDUINO_TRY_ASSIGN(const Recovered done, recover_jobs(ledger_.store(), *blobs_, options_.analyzer, said));
    ledger_.log().add(done.jobs,
                      " jobs that the copy did not know were made of their files; all jobs are held");
    return {};
}

/// The blobs do not belong to this journal: it is a new one, or another printer's.
Result<void> Housekeeping::set_strangers_aside() {
    for (const std::string& sha256 : blobs_->all()) {
        QDUINO_TRY_ASSIGN(const bool wanted, ledger_.store().blob_wanted(sha256));
        if (wanted) continue;
        QDUINO_TRY(blobs_->set_aside(sha256));
    }
    const std::size_t count = blobs_->all_set_aside().size();
    if (count == 0) return {};
    ledger_.log().add(files_set_aside(count));
    return ledger_.hold_queue(files_set_aside(count));
}

Housekeeping::~Housekeeping() {
    // The last copy of a clean stop. If it fails, the copy is an older one.
    if (copier_ && ledger_.is_open()) static_cast<void>(copier_->finish(ledger_.store().commits()));
}

// ---- while it runs ------------------------------------------------------------------------------

std::string Housekeeping::trouble() const {
    if (options_.journal_in_memory) return {};
    std::error_code ignored;
    if (!std::filesystem::exists(options_.folder / "journal.sqlite", ignored))
        return "the job journal has vanished from the state folder: what is taken now is not kept; restart "
               "the service";
    return {};
}

Result<void> Housekeeping::check_room() const {
    if (!ballast_ || ballast_->held()) return {};
    return make_error(ErrorCode::unavailable,
                      "the disk is full: delete some jobs, or other files on that disk");
}

void Housekeeping::keep(Instant now, UnixSeconds now_s) {
    sweep();
    clock_.see(now, now_s);
    retain(now_s);
    if (!copier_) return;
    ballast_->keep(now);
    if (!ballast_->held()) return;  // a copy would take the room that was made
    copier_->after(ledger_.store().commits());
    if (const std::string trouble = copier_->take_trouble(); !trouble.empty())
        ledger_.log().add("the journal could not be copied, the last copy stays: ", trouble);
}

/// A few entries at a time: there may be hundreds of thousands, and a printer waits for its bytes.
void Housekeeping::sweep() {
    std::error_code failed;
    for (int i = 0; i < kSweptEachTick && sweep_ != std::filesystem::directory_iterator{}; ++i) {
        const std::string name = sweep_->path().filename().string();
        sweep_.increment(failed);
        if (failed) sweep_ = {};
        sweep_blob(name);
    }
}

void Housekeeping::sweep_blob(const std::string& name) {
    if (name.ends_with(".part")) return blobs_->remove_partial(name);
    const std::string sha256 = name.substr(0, name.find('.'));
    const Result<bool> wanted = ledger_.store().blob_wanted(sha256);
    if (!wanted.ok() || *wanted) return;
    const std::vector<UploadRecord> uploads = blobs_->records(sha256);
    const bool lost = std::ranges::any_of(
        uploads, [this](JobId id) { return id >= first_new_id_; }, &UploadRecord::id);
    if (!lost) return blobs_->remove(sha256);
    // The upload was confirmed, but this journal never had it: the journal is an older state of
    // itself.
    if (!blobs_->set_aside(sha256).ok()) return;
    const std::string reason = files_set_aside(blobs_->all_set_aside().size());
    ledger_.log().add(reason);
    static_cast<void>(ledger_.hold_queue(reason));
}

/// After the row of `job` has gone, or was never written.
void Housekeeping::drop_files(const Job& job) {
    const Result<bool> wanted = ledger_.store().blob_wanted(job.sha256);
    if (!wanted) return;
    if (*wanted) {
        blobs_->forget(job.sha256, job.id);
    } else {
        blobs_->remove(job.sha256);
    }
}

Result<void> Housekeeping::erase_ended(const std::vector<Job>& jobs) {
    Change change;
    for (const Job& job : jobs) change.erase.push_back(job.id);
    QDUINO_TRY(ledger_.commit(std::move(change)));
    for (const Job& job : jobs) drop_files(job);
    return {};
}

/// Deletes a few of the ended jobs that exceed the limit on their number or their age.
void Housekeeping::retain(UnixSeconds now_s) {
    const Retention& keep = options_.retention;
    const std::int64_t too_many = keep.jobs_max > 0 ? ledger_.store().counts().ended() - keep.jobs_max : 0;
    std::size_t count =
        too_many > 0 ? std::min<std::size_t>(static_cast<std::size_t>(too_many), kErasedEachTick) : 0;
    UnixSeconds until_s = now_s;
    if (count == 0) {
        if (keep.days_max == 0 || !clock_.believed()) return;
        if (std::abs(now_s - retained_s_) < kAgesEvery_s) return;
        until_s = now_s - keep.days_max * kDay_s;
        count = kErasedEachTick;
    }
    const Result<std::vector<Job>> oldest =
        too_many > 0 ? ledger_.store().oldest_ended(count, std::numeric_limits<UnixSeconds>::max())
                     : ledger_.store().oldest_ended(count, until_s, clock_.first_s());
    // All others are younger.
    if (too_many <= 0 && oldest.ok() && oldest->size() < count) retained_s_ = now_s;
    if (!oldest.ok() || oldest->empty()) return;
    if (!erase_ended(*oldest).ok()) return;
    ledger_.log().add("deleted ", oldest->size(), " of the oldest ended jobs: ",
                      too_many > 0 ? "more than --keep-jobs" : "older than --keep-days");
}

/// Makes room for a blob of `bytes` within the store's limit: deletes ended jobs, the oldest first;
/// but none when that would not be enough.
Result<void> Housekeeping::make_room(const std::string& sha256, std::uint64_t bytes) {
    const std::uint64_t limit = options_.retention.bytes_max;
    if (limit == 0) return {};
    QDUINO_TRY_ASSIGN(const bool stored, ledger_.store().blob_wanted(sha256));
    if (stored || ledger_.store().stored_bytes() + bytes <= limit) return {};
    std::vector<std::pair<std::string, std::uint64_t>> needed{{sha256, bytes}};
    for (const Job& job : ledger_.queue().jobs()) needed.emplace_back(job.sha256, job.stored_bytes);
    std::sort(needed.begin(), needed.end());
    std::uint64_t needed_bytes = 0;
    for (std::size_t i = 0; i < needed.size(); ++i)
        needed_bytes += i > 0 && needed[i].first == needed[i - 1].first ? 0 : needed[i].second;
    if (needed_bytes > limit) {
        return make_error(
            ErrorCode::unavailable,
            "the store is full with jobs that still wait or print; delete some of them, or give it more with "
            "--store-limit-mib");
    }
    while (ledger_.store().stored_bytes() + bytes > limit) {
        QDUINO_TRY_ASSIGN(const std::vector<Job> oldest,
                          ledger_.store().oldest_ended(1, std::numeric_limits<UnixSeconds>::max()));
        if (oldest.empty())
            return make_error(ErrorCode::unavailable,
                              "the store is full, and no ended job is left to delete");
        QDUINO_TRY(erase_ended(oldest));
    }
    return {};
}

}  // namespace qduino::spool
