// The store on a disk: one SQLite file, the journal. Every commit is durable before anyone is told
// of it.
//
// WAL with synchronous=FULL: commit() returns after the log is on the disk. One transaction is one
// fact: a power cut leaves it whole or absent. (SQLite, "Write-Ahead Logging" and "PRAGMA
// synchronous".)
//
//   jobs      one row a job                              runs      one row an attempt to print
//   settings  key → value: journal's id, queue's hold …  sessions  SHA-256 of a cookie → expiry
#pragma once

#include <filesystem>
#include <functional>
#include <memory>

#include "spool/store.h"

namespace qduino::spool {

/// One connection. Operating errors (disk full, damaged file) are Results.
class SqliteStore final : public Store {
  public:
    /// `file` ":memory:" keeps everything in memory. Reads the whole file once, and finds damaged
    /// pages. Errors: corrupt, unavailable, unsupported (a newer schema). A damaged file is left as
    /// it is.
    [[nodiscard]] static Result<std::unique_ptr<SqliteStore>> open(const std::filesystem::path& file);
    ~SqliteStore() override;

    [[nodiscard]] Result<StoredState> load() override;
    [[nodiscard]] Result<void> commit(const Commit& commit) override;
    [[nodiscard]] Result<Job> find(JobId id) override;
    [[nodiscard]] Result<std::vector<Job>> ended(const EndedQuery& query) override;
    [[nodiscard]] Result<std::vector<Job>> oldest_ended(std::size_t limit, UnixSeconds until_s,
                                                        UnixSeconds from_s) override;
    [[nodiscard]] Result<bool> blob_wanted(const std::string& sha256, JobId except) override;
    [[nodiscard]] Result<std::string> report_of(JobId job) override;
    /// Kept up to date by commit().
    [[nodiscard]] JobCounts counts() const override { return totals_.counts; }
    [[nodiscard]] std::uint64_t stored_bytes() const override { return totals_.stored_bytes; }
    [[nodiscard]] Result<std::vector<SessionRecord>> sessions() override;
    [[nodiscard]] Result<void> put_session(const SessionRecord& session) override;
    [[nodiscard]] Result<void> erase_session(const std::string& token_hash) override;
    [[nodiscard]] Result<void> keep_sessions(std::size_t count) override;

    /// Grows with every durable commit.
    [[nodiscard]] std::uint64_t commits() const { return commits_; }
    /// `make_room` is called when the disk is full, on the store's thread. True: there is room now,
    /// and what failed is done again.
    void when_full(std::function<bool()> make_room);
    /// For a copy that is older than its journal was: holds everything that waits or prints, so
    /// that nothing of it prints again by itself; holds the queue with `reason`; marks the journal
    /// as not knowing all of its jobs.
    [[nodiscard]] Result<void> hold_everything(const std::string& reason);

  private:
    struct Database;
    explicit SqliteStore(std::unique_ptr<Database> database);
    struct Totals {
        JobCounts counts;
        std::uint64_t stored_bytes = 0;
    };
    void erase_job(JobId id, Totals& totals);
    void write_job(const Job& job, Totals& totals);
    void write(const Commit& commit, Totals& totals);
    void load_totals();

    std::unique_ptr<Database> database_;
    Totals totals_;
    std::uint64_t commits_ = 0;
};

}  // namespace qduino::spool
