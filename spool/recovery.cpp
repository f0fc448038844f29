#include "spool/recovery.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <optional>
#include <vector>

#include "spool/journal.h"
#include "spool/queue.h"

namespace qduino::spool {

namespace {

/// A blob and its uploads, from its record.
struct Found {
    std::string sha256;
    std::vector<UploadRecord> uploads;
    [[nodiscard]] JobId first_id() const { return uploads.empty() ? 0 : uploads.front().id; }
};

Result<bool> has_bytes_of_its_name(const std::filesystem::path& file, const std::string& sha256) {
    std::ifstream stream{file, std::ios::binary};
    if (!stream) return make_error(ErrorCode::internal, "job files: cannot read a stored file");
    Sha256 hash;
    std::array<char, 64 * 1024> bytes;
    while (stream.read(bytes.data(), bytes.size()) || stream.gcount() > 0)
        hash.add({bytes.data(), static_cast<std::size_t>(stream.gcount())});
    return hash.finish() == sha256;
}

std::string name_of(const UploadRecord& record, const std::string& sha256) {
    return check_name(record.name).ok() ? record.name : "recovered-" + sha256.substr(0, 12) + ".gcode";
}

/// One walk through all blobs.
class Walk {
  public:
    Walk(Store& store, const BlobStore& blobs, Analyzer* analyzer)
        : store_(store), blobs_(blobs), analyzer_(analyzer) {}

    Result<void> prepare() {
        const Result<StoredState> state = store_.load();
        if (!state.ok()) return state.error();
        next_id_ = state->next_job_id;
        for (const Job& job : state->jobs) last_order_ = std::max(last_order_, job.order);
        std::vector<std::string> names = blobs_.all();
        const std::vector<std::string> aside = blobs_.all_set_aside();
        names.insert(names.end(), aside.begin(), aside.end());
        std::sort(names.begin(), names.end());
        names.erase(std::unique(names.begin(), names.end()), names.end());
        for (std::string& name : names) {
            found_.push_back({name, blobs_.records(name)});
            for (const UploadRecord& upload : found_.back().uploads)
                next_id_ = std::max(next_id_, upload.id + 1);
        }
        // In the order they came.
        std::stable_sort(found_.begin(), found_.end(),
                         [](const Found& a, const Found& b) { return a.first_id() < b.first_id(); });
        return {};
    }
    [[nodiscard]] const std::vector<Found>& found() const { return found_; }
    [[nodiscard]] Result<std::string> take(const Found& blob);
    [[nodiscard]] Result<void> forget_deleted();
    [[nodiscard]] const Recovered& result() const { return result_; }

  private:
    [[nodiscard]] Result<std::vector<UploadRecord>> lost_uploads(const Found& blob);
    [[nodiscard]] Result<std::string> leave(const Found& blob, const std::string& why);
    [[nodiscard]] Result<std::string> make_jobs(const Found& blob, std::vector<UploadRecord> lost);
    [[nodiscard]] Result<void> forget(const std::vector<Job>& jobs);

    Store& store_;
    const BlobStore& blobs_;
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
    const Result<bool> wanted = store_.blob_wanted(blob.sha256);
    if (!wanted.ok()) return wanted.error();
    if (!*wanted) lost.push_back({next_id_++, 0, {}});
    return lost;
}

Result<std::string> Walk::leave(const Found& blob, const std::string& why) {
    if (const Result<void> moved = blobs_.set_aside(blob.sha256); !moved.ok()) return moved.error();
    ++result_.left;
    return blob.sha256.substr(0, 12) + ": left in set-aside/: " + why;
}

Result<std::string> Walk::take(const Found& blob) {
    Result<std::vector<UploadRecord>> lost = lost_uploads(blob);
    if (!lost.ok()) return lost.error();
    if (lost->empty()) {
        ++result_.known;
        return blob.sha256.substr(0, 12) + ": the journal has its jobs";
    }
    const Result<bool> whole = has_bytes_of_its_name(blobs_.find_gcode(blob.sha256), blob.sha256);
    if (!whole.ok()) return whole.error();
    if (!*whole) return leave(blob, "its bytes are damaged; upload the file again");
    return make_jobs(blob, std::move(*lost));
}

Result<std::string> Walk::make_jobs(const Found& blob, std::vector<UploadRecord> lost) {
    const std::filesystem::path gcode = blobs_.find_gcode(blob.sha256);
    // A place for the packed layers; removed with it.
    Result<std::unique_ptr<StagedFile>> room = blobs_.stage();
    if (!room.ok()) return room.error();
    Result<Analysis> analysis = Analysis{};
    if (analyzer_) analysis = analyzer_->analyze(gcode, (*room)->layers_path());
    if (!analysis.ok()) return analysis.error();
    if (analysis->verdict != Analysis::Verdict::fits) return leave(blob, analysis->message);

    Job job;
    std::error_code absent;
    job.sha256 = blob.sha256;
    job.size = std::filesystem::file_size(gcode, absent);
    describe(job, *analysis);
    const BlobCompanions companions{analysis->layers_json, analysis->thumbnail};
    job.stored_bytes = BlobStore::size_of(job.size, (*room)->layers_path(), companions);
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
    const Result<void> adopted = blobs_.adopt_again(blob.sha256, (*room)->layers_path(), companions, uploads);
    if (!adopted.ok()) return adopted.error();
    if (const Result<void> done = store_.commit(commit); !done.ok()) return done.error();
    result_.jobs += commit.jobs.put.size();
    return "job " + std::to_string(job.id) + " (" + job.name + "), held";
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
    const Result<StoredState> state = store_.load();
    if (!state.ok()) return state.error();
    if (!state->rebuilding || found_.empty()) return {};
    if (const Result<void> done = forget(state->jobs); !done.ok()) return done;
    EndedQuery query;
    query.limit = 1000;
    for (;;) {
        const Result<std::vector<Job>> page = store_.ended(query);
        if (!page.ok()) return page.error();
        if (page->empty()) return {};
        query.below_order = page->back().order;
        if (const Result<void> done = forget(*page); !done.ok()) return done;
    }
}

}  // namespace

void describe(Job& job, const Analysis& analysis) {
    job.facts_json = analysis.facts_json.empty() ? "{}" : analysis.facts_json;
    job.estimated_s = analysis.estimated_s;
    job.has_layers = !analysis.layers_json.empty();
    job.has_thumbnail = !analysis.thumbnail.empty();
}

Result<Recovered> recover_jobs(Store& store, const BlobStore& blobs, Analyzer* analyzer,
                               const RecoveryProgress& progress) {
    Walk walk{store, blobs, analyzer};
    if (const Result<void> ready = walk.prepare(); !ready.ok()) return ready.error();
    if (const Result<void> done = walk.forget_deleted(); !done.ok()) return done.error();
    std::size_t done = 0;
    for (const Found& blob : walk.found()) {
        const Result<std::string> words = walk.take(blob);
        if (!words.ok()) return words.error();
        progress(++done, walk.found().size(), *words);
    }
    Commit whole;
    whole.rebuilding = false;
    if (const Result<void> committed = store.commit(whole); !committed.ok()) return committed.error();
    return walk.result();
}

Result<Recovered> recover_folder(const std::filesystem::path& folder, Analyzer& analyzer, UnixSeconds now_s,
                                 const std::function<void(const std::string&)>& log) {
    Result<std::unique_ptr<BlobStore>> blobs = BlobStore::open(folder, {});
    if (!blobs.ok()) return blobs.error();
    Result<OpenedJournal> journal = open_journal(folder, now_s);
    const bool hopeless = !journal.ok() && (journal.error().code == ErrorCode::unsupported ||
                                            journal.error().code == ErrorCode::corrupt);
    if (hopeless) {
        const Result<std::string> aside = set_journal_aside(folder, now_s);
        if (!aside.ok()) return aside.error();
        log("the journal cannot be used; it was set aside as " + *aside);
        set_copy_aside(folder, *aside);
        journal = open_journal(folder, now_s);
    }
    if (!journal.ok()) return journal.error();
    if (!journal->repaired.empty()) log("the journal was repaired from its copy: " + journal->repaired);
    const auto report = [&](std::size_t done, std::size_t total, const std::string& words) {
        log(std::to_string(done) + " of " + std::to_string(total) + ": " + words);
    };
    Result<Recovered> recovered = recover_jobs(*journal->store, **blobs, &analyzer, report);
    if (!recovered.ok()) return recovered;
    const Result<StoredState> state = journal->store->load();
    if (!state.ok()) return state.error();
    if (recovered->jobs > 0) {
        Commit hold;
        hold.gate = state->gate;
        hold.gate->hold_reason =
            "jobs were recovered from their files: look through them, each of them is held";
        if (const Result<void> held = journal->store->commit(hold); !held.ok()) return held.error();
    }
    if (const Result<void> known = (*blobs)->set_journal_id(state->journal_id); !known.ok())
        return known.error();
    journal->store.reset();
    return recovered;
}

}  // namespace qduino::spool
