#include "spool/disk/disk_storage.h"

#include <algorithm>

#include "spool/disk/recovery.h"

namespace qduino::spool {

namespace {

constexpr int kSweptEachTick = 64;

std::string files_set_aside(std::size_t count) {
    return text<std::string>(count, count == 1 ? " stored file is" : " stored files are",
                             " set aside that the job journal does not know: stop the service and run printd "
                             "--recover to have their jobs again");
}

}  // namespace

// ---- start and end ------------------------------------------------------------------------------

Result<std::unique_ptr<DiskStorage>> DiskStorage::open(DiskOptions options) {
    // The blobs' folder is made first: the ballast lies in it.
    QDUINO_TRY_ASSIGN(std::unique_ptr<BlobStore> blobs, BlobStore::open(options.folder, options.limits));
    QDUINO_TRY_ASSIGN(OpenedJournal journal, open_journal(options.folder, options.opened_s));
    std::unique_ptr<DiskStorage> storage{new DiskStorage{std::move(options)}};
    storage->blobs_ = std::move(blobs);
    storage->store_ = std::move(journal.store);
    storage->store_->when_full([disk = storage.get()] {
        const bool given = disk->ballast_.give_up();
        if (given)
            disk->log("the disk is full: the room that was kept for this is used; uploads are refused");
        return given;
    });
    if (!journal.repaired.empty())
        storage->log("the job journal was damaged, and is repaired from its copy: ", journal.repaired);
    return storage;
}

/// Checks that the journal is the one that the blobs belong to.
Result<StoredState> DiskStorage::load() {
    QDUINO_TRY_ASSIGN(StoredState state, store_->load());
    const std::string known = blobs_->journal_id();
    // An older program wrote no id. A journal of such a program that has jobs is the blobs' own.
    const bool of_an_older_program = known.empty() && store_->counts().total() > 0;
    if (state.rebuilding) {
        QDUINO_TRY(rebuild());
        QDUINO_TRY_ASSIGN(state, store_->load());
    } else if (known != state.journal_id && !of_an_older_program) {
        QDUINO_TRY(set_strangers_aside(state.gate));
    } else if (const std::size_t count = blobs_->all_set_aside().size(); count > 0) {
        log(files_set_aside(count));
    }
    std::error_code failed;
    sweep_ = std::filesystem::directory_iterator{blobs_->blobs_folder(), failed};
    if (known != state.journal_id) QDUINO_TRY(blobs_->set_journal_id(state.journal_id));
    first_new_id_ = state.next_job_id;
    copier_.begin_if_missing();
    return state;
}

Result<void> DiskStorage::rebuild() {
    const auto said = [this](std::size_t done, std::size_t total, const std::string& words) {
        if (done == total || done % 100 == 0)
            log("stored files: ", done, " of ", total, " looked at; ", words);
    };
    QDUINO_TRY_ASSIGN(const Recovered done, recover_jobs(*store_, *blobs_, options_.analyzer, said));
    log(done.jobs, " jobs that the copy did not know were made of their files; all jobs are held");
    return {};
}

/// The blobs do not belong to this journal: it is a new one, or another printer's.
Result<void> DiskStorage::set_strangers_aside(QueueGate& gate) {
    for (const std::string& sha256 : blobs_->all()) {
        QDUINO_TRY_ASSIGN(const bool wanted, store_->blob_wanted(sha256, 0));
        if (wanted) continue;
        QDUINO_TRY(blobs_->set_aside(sha256));
    }
    const std::size_t count = blobs_->all_set_aside().size();
    if (count == 0) return {};
    log(files_set_aside(count));
    gate.hold_reason = files_set_aside(count);
    return store_->commit({.gate = gate});
}

DiskStorage::~DiskStorage() { static_cast<void>(copier_.finish(store_->commits())); }

// ---- while it runs ------------------------------------------------------------------------------

std::string DiskStorage::trouble() const {
    std::error_code ignored;
    if (!std::filesystem::exists(options_.folder / "journal.sqlite", ignored))
        return "the job journal has vanished from the state folder: what is taken now is not kept; restart "
               "the service";
    return {};
}

Result<void> DiskStorage::check_room() const {
    if (ballast_.held()) return {};
    return make_error(ErrorCode::unavailable,
                      "the disk is full: delete some jobs, or other files on that disk");
}

void DiskStorage::keep(Instant now) {
    sweep();
    ballast_.keep(now);
    if (!ballast_.held()) return;  // a copy would take the room that was made
    copier_.after(store_->commits());
    if (const std::string trouble = copier_.take_trouble(); !trouble.empty())
        log("the journal could not be copied, the last copy stays: ", trouble);
}

/// A few entries at a time: there may be hundreds of thousands, and a printer waits for its bytes.
void DiskStorage::sweep() {
    std::error_code failed;
    for (int i = 0; i < kSweptEachTick && sweep_ != std::filesystem::directory_iterator{}; ++i) {
        const std::string name = sweep_->path().filename().string();
        sweep_.increment(failed);
        if (failed) sweep_ = {};
        sweep_blob(name);
    }
}

void DiskStorage::sweep_blob(const std::string& name) {
    if (name.ends_with(".part")) return blobs_->remove_partial(name);
    const std::string sha256 = name.substr(0, name.find('.'));
    const Result<bool> wanted = store_->blob_wanted(sha256, 0);
    if (!wanted.ok() || *wanted) return;
    const std::vector<UploadRecord> uploads = blobs_->records(sha256);
    const bool lost = std::ranges::any_of(
        uploads, [this](JobId id) { return id >= first_new_id_; }, &UploadRecord::id);
    if (!lost) return blobs_->remove(sha256);
    // The upload was confirmed, but this journal never had it: the journal is an older state of
    // itself.
    if (!blobs_->set_aside(sha256).ok()) return;
    news_.hold_reason = files_set_aside(blobs_->all_set_aside().size());
    log(news_.hold_reason);
}

}  // namespace qduino::spool
