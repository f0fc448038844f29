#include "spool/disk/recovery.h"

#include <algorithm>
#include <array>
#include <vector>

#include "posix/file_bytes.h"
#include "spool/disk/journal.h"
#include "spool/queue.h"

namespace qduino::spool {

namespace {

/// A blob and its uploads, from its record.
struct Found {
    std::string sha256;
    std::vector<UploadRecord> uploads;
    [[nodiscard]] JobId first_id() const { return uploads.empty() ? 0 : uploads.front().id; }
};

Result<bool> has_bytes_of_its_name(const ByteSource& file, const std::string& sha256) {
    Sha256 hash;
    std::array<char, 64 * 1024> bytes;
    for (std::uint64_t at = 0;;) {
        QDUINO_TRY_ASSIGN(const std::size_t count, file.read_at(at, bytes));
        if (count == 0) break;
        hash.add(std::span{bytes}.first(count));
        at += count;
    }
    return hash.finish() == sha256;
}

std::string name_of(const UploadRecord& record, const std::string& sha256) {
    return check_name(record.name).ok() ? record.name : "recovered-" + sha256.substr(0, 12) + ".gcode";
}

/// One walk through all blobs.
class Walk {
  public:
    Walk(Store& store, BlobStore& blobs, Analyzer* analyzer)
        : store_(store), blobs_(blobs), analyzer_(analyzer) {}

    Result<void> prepare() {
        QDUINO_TRY_ASSIGN(const StoredState state, store_.load());
        next_id_ = state.next_job_id;
        for (const Job& job : state.jobs) last_order_ = std::max(last_order_, job.order);
        const std::vector<std::string> stored = blobs_.all();
        const std::vector<std::string> aside = blobs_.all_set_aside();
        std::vector<std::string> names;
        std::ranges::set_union(stored, aside, std::back_inserter(names));
        for (const std::string& name : names) {
            found_.push_back({name, blobs_.records(name)});
            for (const UploadRecord& upload : found_.back().uploads)
                next_id_ = std::max(next_id_, upload.id + 1);
        }
        // In the order they came.
        std::ranges::stable_sort(found_, {}, &Found::first_id);
        return {};
    }
    [[nodiscard]] const std::vector<Found>& found() const { return found_; }
    [[nodiscard]] Result<std::string> take(const Found& blob);
    [[nodiscard]] Result<void> forget_deleted();
    [[nodiscard]] const Recovered& result() const { return result_; }

  private:
    [[nodiscard]] Result<std::vector<UploadRecord>> lost_uploads(const Found& blob);
    [[nodiscard]] Result<std::string> leave(const Found& blob, const std::string& why);
    [[nodiscard]] Result<std::string> make_jobs(const Found& blob, std::vector<UploadRecord> lost,
                                                const ByteSource& gcode);
    [[nodiscard]] Result<void> forget(const std::vector<Job>& jobs);

    Store& store_;
    BlobStore& blobs_;
    Analyzer* analyzer_;
    std::vector<Found> found_;
    JobId next_id_ = 1;
    std::int64_t last_order_ = 0;
    Recovered result_;
};

/// The uploads that the journal has no row of. Each keeps its number for its job, unless another
/// job has that number.
Result<std::vector<UploadRecord>> Walk::lost_uploads(const Found& blob) {
    std::vector<UploadRecord> lost;
    for (const UploadRecord& upload : blob.uploads) {
        const Result<Job> row = store_.find(upload.id);
        if (!row.ok() && row.error().code != ErrorCode::not_found) return row.error();
        if (row.ok() && row->sha256 == blob.sha256) continue;
        lost.push_back(upload);
        if (row.ok()) lost.back().id = next_id_++;
    }
    if (!blob.uploads.empty()) return lost;
    QDUINO_TRY_ASSIGN(const bool wanted, store_.blob_wanted(blob.sha256));
    if (!wanted) lost.push_back({next_id_++, 0, {}});
    return lost;
}

Result<std::string> Walk::leave(const Found& blob, const std::string& why) {
    QDUINO_TRY(blobs_.set_aside(blob.sha256));
    ++result_.left;
    return blob.sha256.substr(0, 12) + ": left in set-aside/: " + why;
}

Result<std::string> Walk::take(const Found& blob) {
    QDUINO_TRY_ASSIGN(std::vector<UploadRecord> lost, lost_uploads(blob));
    if (lost.empty()) {
        ++result_.known;
        return blob.sha256.substr(0, 12) + ": the journal has its jobs";
    }
    const auto gcode = posix::FileBytes::open(blobs_.find_gcode(blob.sha256));
    if (!gcode) return make_error(ErrorCode::internal, "job files: cannot read a stored file");
    QDUINO_TRY_ASSIGN(const bool whole, has_bytes_of_its_name(*gcode, blob.sha256));
    if (!whole) return leave(blob, "its bytes are damaged; upload the file again");
    return make_jobs(blob, std::move(lost), *gcode);
}

Result<std::string> Walk::make_jobs(const Found& blob, std::vector<UploadRecord> lost,
                                    const ByteSource& gcode) {
    // A place for the packed layers; removed with it.
    QDUINO_TRY_ASSIGN(std::unique_ptr<StagedFile> room, blobs_.stage());
    Result<Analysis> analysis = Analysis{};
    if (analyzer_) analysis = analyzer_->analyze(gcode, room->layers());
    if (!analysis.ok()) return analysis.error();
    if (analysis->verdict != Analysis::Verdict::fits) return leave(blob, analysis->message);

    Job job;
    job.sha256 = blob.sha256;
    job.size = gcode.size();
    describe(job, *analysis);
    const FileCompanions companions{analysis->layers_json, analysis->thumbnail};
    job.stored_bytes = job.size + stored_bytes_of(*room, companions);
    job.hold = true;
    Commit commit;
    std::vector<UploadRecord> uploads;
    for (const UploadRecord& upload : blob.uploads) {
        if (const Result<Job> row = store_.find(upload.id); row.ok() && row->sha256 == blob.sha256)
            uploads.push_back(upload);
    }
    for (UploadRecord& upload : lost) {
        upload.name = name_of(upload, blob.sha256);
        job.id = upload.id;
        job.name = upload.name;
        job.created_s = upload.uploaded_s;
        job.order = ++last_order_;
        commit.jobs.put.push_back(job);
        uploads.push_back(upload);
    }
    QDUINO_TRY(blobs_.adopt_again(blob.sha256, static_cast<IncomingFile&>(*room).layers_path(), companions,
                                  uploads));
    QDUINO_TRY(store_.commit(commit));
    result_.jobs += commit.jobs.put.size();
    return text<std::string>("job ", job.id, " (", job.name, "), held");
}

Result<void> Walk::forget(const std::vector<Job>& jobs) {
    Commit commit;
    for (const Job& job : jobs) {
        const bool gone = !std::filesystem::exists(blobs_.path(job.sha256, BlobPart::gcode));
        if (gone && job.state != JobState::printing) commit.jobs.erase.push_back(job.id);
    }
    if (commit.jobs.erase.empty()) return {};
    result_.forgotten += commit.jobs.erase.size();
    return store_.commit(commit);
}

/// A copy may still have the rows of jobs that were deleted after it was made: their files are
/// gone. If there are no files at all, the folder is missing instead.
Result<void> Walk::forget_deleted() {
    QDUINO_TRY_ASSIGN(const StoredState state, store_.load());
    if (!state.rebuilding || found_.empty()) return {};
    QDUINO_TRY(forget(state.jobs));
    EndedQuery query;
    query.limit = 1000;
    for (;;) {
        QDUINO_TRY_ASSIGN(const std::vector<Job> page, store_.ended(query));
        if (page.empty()) return {};
        query.below_order = page.back().order;
        QDUINO_TRY(forget(page));
    }
}

}  // namespace

Result<Recovered> recover_jobs(Store& store, BlobStore& blobs, Analyzer* analyzer,
                               const RecoveryProgress& progress) {
    Walk walk{store, blobs, analyzer};
    QDUINO_TRY(walk.prepare());
    QDUINO_TRY(walk.forget_deleted());
    std::size_t done = 0;
    for (const Found& blob : walk.found()) {
        QDUINO_TRY_ASSIGN(const std::string words, walk.take(blob));
        progress(++done, walk.found().size(), words);
    }
    QDUINO_TRY(store.commit({.rebuilding = false}));
    return walk.result();
}

Result<Recovered> recover_folder(const std::filesystem::path& folder, Analyzer& analyzer, UnixSeconds now_s,
                                 const std::function<void(const std::string&)>& log) {
    QDUINO_TRY_ASSIGN(std::unique_ptr<BlobStore> blobs, BlobStore::open(folder, {}));
    Result<OpenedJournal> journal = open_journal(folder, now_s);
    const bool hopeless = !journal.ok() && (journal.error().code == ErrorCode::unsupported ||
                                            journal.error().code == ErrorCode::corrupt);
    if (hopeless) {
        QDUINO_TRY_ASSIGN(const std::string aside, set_journal_aside(folder, now_s));
        log("the journal cannot be used; it was set aside as " + aside);
        set_copy_aside(folder, aside);
        journal = open_journal(folder, now_s);
    }
    if (!journal.ok()) return journal.error();
    if (!journal->repaired.empty()) log("the journal was repaired from its copy: " + journal->repaired);
    const auto report = [&](std::size_t done, std::size_t total, const std::string& words) {
        log(text<std::string>(done, " of ", total, ": ", words));
    };
    QDUINO_TRY_ASSIGN(const Recovered recovered, recover_jobs(*journal->store, *blobs, &analyzer, report));
    QDUINO_TRY_ASSIGN(const StoredState state, journal->store->load());
    if (recovered.jobs > 0) {
        QueueGate gate = state.gate;
        gate.hold_reason = "jobs were recovered from their files: look through them, each of them is held";
        QDUINO_TRY(journal->store->commit({.gate = gate}));
    }
    QDUINO_TRY(blobs->set_journal_id(state.journal_id));
    journal->store.reset();
    return recovered;
}

}  // namespace qduino::spool
