// What a spool keeps its jobs in where there is no disk. Nothing is durable: what was in memory is
// gone with the power, and as nobody then knows whether the bed is clear, the first job waits for a
// person to say so.
//
//   ▓▓▓▓▓░░░  prints        Files lie in places of one size, taken from the heap once: a heap that
//   ▓▓░░░░░░  waits         joins no blocks (board/metal/library/heap.h) would be used up by files
//   ▓▓▓▓▓▓▓▓  comes in      of ever other sizes, and where no memory is left the machine ends, in
//   ▓░░░░░░░  ended         the middle of a print. So a file that finds no place is refused.
//
// One thread.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/sha256.h"
#include "spool/storage.h"

namespace qduino::spool {

class MemoryStore final : public Store {
  public:
    /// More are refused: a job takes memory, too.
    static constexpr std::size_t kJobsMax = 64;

    [[nodiscard]] Result<StoredState> load() override;
    [[nodiscard]] Result<void> commit(const Commit& commit) override;
    [[nodiscard]] Result<Job> find(JobId id) override;
    [[nodiscard]] Result<std::vector<Job>> ended(const EndedQuery& query) override;
    [[nodiscard]] Result<std::vector<Job>> oldest_ended(std::size_t limit, UnixSeconds until_s,
                                                        UnixSeconds from_s) override;
    [[nodiscard]] Result<bool> blob_wanted(const std::string& sha256, JobId except) override;
    [[nodiscard]] Result<std::string> report_of(JobId job) override;
    [[nodiscard]] JobCounts counts() const override;
    [[nodiscard]] std::uint64_t stored_bytes() const override;
    [[nodiscard]] Result<std::vector<SessionRecord>> sessions() override;
    [[nodiscard]] Result<void> put_session(const SessionRecord& session) override;
    [[nodiscard]] Result<void> erase_session(const std::string& token_hash) override;
    [[nodiscard]] Result<void> keep_sessions(std::size_t count) override;

  private:
    struct Row {
        Run run;
        bool ended = false;
        std::optional<std::string> report;
    };
    [[nodiscard]] Result<void> check(const Commit& commit) const;
    void erase(JobId id);
    [[nodiscard]] std::vector<Job> ended_jobs() const;

    std::map<JobId, Job> jobs_;
    std::map<std::uint64_t, Row> runs_;
    std::vector<SessionRecord> sessions_;
    QueueGate gate_;
    bool rebuilding_ = false;
    JobId next_id_ = 1;
};

class MemoryFiles final : public Files {
  public:
    struct Limits {
        std::size_t places = 4;
        /// 16 MiB with a heap block's head.
        std::size_t file_bytes_max = (std::size_t{16} << 20) - 64;
        /// A file whose packed layers are longer has none.
        std::size_t layers_bytes_max = (std::size_t{4} << 20) - 64;
    };

    explicit MemoryFiles(Limits limits);

    /// `make_room` is called when no place is free. True: something was deleted.
    void when_full(std::function<bool()> make_room) { make_room_ = std::move(make_room); }

    [[nodiscard]] Result<std::unique_ptr<StagedFile>> stage() override;
    [[nodiscard]] Result<void> adopt(StagedFile& file, const FileCompanions& companions,
                                     const UploadRecord& record) override;
    void remove(const std::string& sha256) override { files_.erase(sha256); }
    [[nodiscard]] std::shared_ptr<const ByteSource> content(const std::string& sha256,
                                                            FilePart part) const override;
    [[nodiscard]] std::uint64_t size_max_bytes() const override { return limits_.file_bytes_max; }

  private:
    class Incoming;
    /// Its holders' until nobody holds it any more: the spool, an upload, an answer.
    struct Place {
        std::string gcode, layers, layers_index, thumbnail;
    };
    [[nodiscard]] std::shared_ptr<Place> free_place() const;

    Limits limits_;
    std::function<bool()> make_room_ = [] { return false; };
    std::vector<std::shared_ptr<Place>> places_;
    std::map<std::string, std::shared_ptr<Place>> files_;  // by SHA-256
};

class MemoryStorage final : public Storage {
  public:
    explicit MemoryStorage(MemoryFiles::Limits limits = {}) : files_(limits) {}

    [[nodiscard]] MemoryStore& store() override { return store_; }
    [[nodiscard]] MemoryFiles& files() override { return files_; }
    [[nodiscard]] Result<StoredState> load() override {
        QDUINO_TRY(store_.commit({.gate = QueueGate{{}, true}}));
        return store_.load();
    }
    [[nodiscard]] bool is_durable() const override { return false; }

  private:
    MemoryStore store_;
    MemoryFiles files_;
};

}  // namespace qduino::spool
