#include "spool/memory_storage.h"

#include <algorithm>

#include "spool/name_search.h"

namespace qduino::spool {

// ---- the store ----------------------------------------------------------------------------------

Result<StoredState> MemoryStore::load() {
    StoredState state;
    for (const auto& [id, job] : jobs_) {
        if (!is_ended(job.state)) state.jobs.push_back(job);
        if (is_ended(job.state)) state.last_ended = std::max(state.last_ended, job.order);
        state.newest_s = std::max({state.newest_s, job.created_s, job.ended_s});
    }
    for (const auto& [id, row] : runs_) {
        state.last_run_id = id;
        if (!row.ended) state.active_run = row.run;
        if (row.ended && row.run.inspected && !row.report) state.awaited_report = row.run;
    }
    state.next_job_id = next_id_;
    state.gate = gate_;
    state.rebuilding = rebuilding_;
    return state;
}

/// What a commit may not do.
Result<void> MemoryStore::check(const Commit& commit) const {
    std::map<JobId, JobState> after;
    for (const auto& [id, job] : jobs_) after[id] = job.state;
    for (const JobId id : commit.jobs.erase) after.erase(id);
    const std::size_t before = after.size();
    for (const Job& job : commit.jobs.put) after[job.id] = job.state;
    if (after.size() > std::max(before, kJobsMax))
        return make_error(ErrorCode::unavailable, "this printer's memory has room for ", kJobsMax,
                          " jobs: delete some");
    const auto printing =
        std::ranges::count_if(after, [](const auto& each) { return each.second == JobState::printing; });
    const bool runs = std::ranges::any_of(runs_, [](const auto& each) { return !each.second.ended; });
    if (printing > 1 || (commit.run_begun && !commit.run_ended && runs))
        return make_error(ErrorCode::internal, "job store: one job prints at a time");
    return {};
}

Result<void> MemoryStore::commit(const Commit& commit) {
    QDUINO_TRY(check(commit));
    for (const JobId id : commit.jobs.erase) erase(id);
    for (const Job& job : commit.jobs.put) {
        jobs_[job.id] = job;
        next_id_ = std::max(next_id_, job.id + 1);
    }
    if (commit.run_changed) {
        if (const auto at = runs_.find(commit.run_changed->id); at != runs_.end())
            at->second.run = *commit.run_changed;
    }
    if (commit.run_ended) {
        if (const auto at = runs_.find(commit.run_ended->run); at != runs_.end()) at->second.ended = true;
    }
    if (commit.run_begun) runs_[commit.run_begun->id] = {*commit.run_begun, false, {}};
    if (commit.gate) gate_ = *commit.gate;
    if (commit.rebuilding) rebuilding_ = *commit.rebuilding;
    if (commit.report) {
        if (const auto at = runs_.find(commit.report->first); at != runs_.end())
            at->second.report = commit.report->second;
    }
    return {};
}

/// The newest run stays: its number must never be given again.
void MemoryStore::erase(JobId id) {
    jobs_.erase(id);
    std::erase_if(runs_, [&](const auto& each) {
        return each.second.run.job == id && each.second.ended && each.first != runs_.rbegin()->first;
    });
    for (auto& [number, row] : runs_) {
        if (row.run.job == id) row.report = "";
    }
}

Result<Job> MemoryStore::find(JobId id) {
    const auto at = jobs_.find(id);
    return at == jobs_.end() ? Result<Job>{no_such_job()} : at->second;
}

/// Those that ended last come first.
std::vector<Job> MemoryStore::ended_jobs() const {
    std::vector<Job> ended;
    for (const auto& [id, job] : jobs_) {
        if (is_ended(job.state)) ended.push_back(job);
    }
    std::ranges::sort(ended, std::greater{}, &Job::order);
    return ended;
}

Result<std::vector<Job>> MemoryStore::ended(const EndedQuery& query) {
    const std::string part = folded(query.text);
    std::vector<Job> found = ended_jobs();
    std::erase_if(found, [&](const Job& job) {
        const bool state = query.states.empty() || std::ranges::count(query.states, job.state) > 0;
        return !state || (query.below_order && job.order >= *query.below_order) ||
               (!part.empty() && !name_holds(job.name, part));
    });
    if (found.size() > query.limit) found.resize(query.limit);
    return found;
}

Result<std::vector<Job>> MemoryStore::oldest_ended(std::size_t limit, UnixSeconds until_s,
                                                   UnixSeconds from_s) {
    std::vector<Job> found = ended_jobs();
    std::erase_if(found, [&](const Job& job) { return job.ended_s < from_s || job.ended_s > until_s; });
    std::ranges::reverse(found);
    if (found.size() > limit) found.resize(limit);
    return found;
}

Result<bool> MemoryStore::blob_wanted(const std::string& sha256, JobId except) {
    return std::ranges::any_of(
        jobs_, [&](const auto& each) { return each.first != except && each.second.sha256 == sha256; });
}

Result<std::string> MemoryStore::report_of(JobId job) {
    std::string newest;
    for (const auto& [id, row] : runs_) {
        if (row.run.job == job && !row.report.value_or("").empty()) newest = *row.report;
    }
    if (newest.empty()) return make_error(ErrorCode::not_found, "there is no report of this job");
    return newest;
}

JobCounts MemoryStore::counts() const {
    JobCounts counts;
    for (const auto& [id, job] : jobs_) ++counts.of(job.state);
    return counts;
}

std::uint64_t MemoryStore::stored_bytes() const {
    std::map<std::string_view, std::uint64_t> files;
    for (const auto& [id, job] : jobs_) files[job.sha256] = job.stored_bytes;
    std::uint64_t total = 0;
    for (const auto& [sha256, bytes] : files) total += bytes;
    return total;
}

Result<std::vector<SessionRecord>> MemoryStore::sessions() { return sessions_; }

Result<void> MemoryStore::put_session(const SessionRecord& session) {
    QDUINO_TRY(erase_session(session.token_hash));
    sessions_.push_back(session);
    return {};
}

Result<void> MemoryStore::erase_session(const std::string& token_hash) {
    std::erase_if(sessions_, [&](const SessionRecord& each) { return each.token_hash == token_hash; });
    return {};
}

Result<void> MemoryStore::keep_sessions(std::size_t count) {
    std::ranges::sort(sessions_, std::greater{}, &SessionRecord::expires_s);
    if (sessions_.size() > count) sessions_.resize(count);
    return {};
}

// ---- files --------------------------------------------------------------------------------------

/// An upload that fills a place.
class MemoryFiles::Incoming final : public StagedFile {
  public:
    Incoming(std::shared_ptr<Place> place, Limits limits) : limits_(limits), place_(std::move(place)) {}

    Result<void> write(std::span<const char> bytes) override {
        if (bytes.size() > limits_.file_bytes_max - size_)
            return make_error(ErrorCode::out_of_range, "the file is longer than this printer accepts");
        place_->gcode.append(bytes.data(), bytes.size());
        hash_.add(bytes);
        size_ += bytes.size();
        return {};
    }
    Result<void> seal() override {
        sha256_ = hash_.finish();
        return {};
    }
    ByteSink& layers() override { return layers_; }
    std::shared_ptr<const ByteSource> content() const override {
        return std::make_shared<BytesInMemory>(std::shared_ptr<const std::string>{place_, &place_->gcode});
    }
    std::uint64_t layers_bytes() const override { return place_->layers.size(); }
    [[nodiscard]] const std::shared_ptr<Place>& place() const { return place_; }

  private:
    class Layers final : public ByteSink {
      public:
        explicit Layers(Incoming& file) : file_(file) {}
        Result<void> write(std::span<const char> bytes) override {
            std::string& layers = file_.place_->layers;
            if (layers.size() + bytes.size() > file_.limits_.layers_bytes_max)
                return make_error(ErrorCode::out_of_range, "there is no room for so many layers");
            layers.append(bytes.data(), bytes.size());
            return {};
        }

      private:
        Incoming& file_;
    };

    Limits limits_;
    std::shared_ptr<Place> place_;
    BareSha256 hash_;
    Layers layers_{*this};
};

MemoryFiles::MemoryFiles(Limits limits) : limits_(limits) {
    for (std::size_t i = 0; i < limits.places; ++i) {
        places_.push_back(std::make_shared<Place>());
        places_.back()->gcode.reserve(limits.file_bytes_max);
        places_.back()->layers.reserve(limits.layers_bytes_max);
    }
}

std::shared_ptr<MemoryFiles::Place> MemoryFiles::free_place() const {
    const auto free = std::ranges::find(places_, 1, [](const auto& place) { return place.use_count(); });
    return free == places_.end() ? nullptr : *free;
}

Result<std::unique_ptr<StagedFile>> MemoryFiles::stage() {
    std::shared_ptr<Place> place = free_place();
    while (!place && make_room_()) place = free_place();
    if (!place)
        return make_error(
            ErrorCode::unavailable,
            "this printer's memory is full of files that print, wait or come in; try again later");
    for (std::string* part : {&place->gcode, &place->layers, &place->layers_index, &place->thumbnail})
        part->clear();
    return std::unique_ptr<StagedFile>{std::make_unique<Incoming>(std::move(place), limits_)};
}

Result<void> MemoryFiles::adopt(StagedFile& file, const FileCompanions& companions, const UploadRecord&) {
    QDUINO_EXPECT(!file.sha256().empty());
    const auto& place = static_cast<const Incoming&>(file).place();  // stage() makes no others
    place->layers_index = companions.layers_index;
    place->thumbnail = companions.thumbnail;
    files_.emplace(file.sha256(), place);
    return {};
}

std::shared_ptr<const ByteSource> MemoryFiles::content(const std::string& sha256, FilePart part) const {
    const auto at = files_.find(sha256);
    if (at == files_.end()) return nullptr;
    const Place& place = *at->second;
    const std::string* const parts[] = {&place.gcode, &place.layers, &place.layers_index, &place.thumbnail};
    const std::string* const bytes = parts[static_cast<std::size_t>(part)];
    if (part != FilePart::gcode && bytes->empty()) return nullptr;
    return std::make_shared<BytesInMemory>(std::shared_ptr<const std::string>{at->second, bytes});
}

}  // namespace qduino::spool
