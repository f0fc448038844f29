// The journal: jobs, runs and settings in one SQLite file. Every commit is durable before anyone is
// told of it.
//
// WAL with synchronous=FULL: commit() returns after the log is on the disk. One transaction is one
// fact: a power cut leaves it whole or absent. (SQLite, "Write-Ahead Logging" and "PRAGMA
// synchronous".)
//
//   jobs      one row a job                              runs      one row an attempt to print
//   settings  key → value: journal's id, queue's hold …  sessions  SHA-256 of a cookie → expiry
//
// Jobs that wait or print are read once, at the start. There may be a hundred thousand ended ones,
// so these are read when they are asked for, a page at a time by an index.
#pragma once

#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/result.h"
#include "spool/queue.h"
#include "spool/run.h"

namespace qduino::spool {

/// A browser's session. The token itself is never stored.
struct SessionRecord {
    std::string token_hash;  ///< hexadecimal
    UnixSeconds expires_s = 0;
};

/// What holds printing up besides a machine that is not ready.
struct QueueGate {
    std::string hold_reason;  ///< the queue is held, for this reason; empty: it is not
    bool bed_occupied = false;
};

/// One transaction. Empty parts change nothing.
struct Commit {
    Change jobs{};
    std::optional<Run> run_begun{};
    struct RunEnd {
        std::uint64_t run = 0;
        std::string outcome;  ///< completed, cancelled, failed
        UnixSeconds ended_s = 0;
    };
    std::optional<RunEnd> run_ended{};
    std::optional<Run> run_changed{};  ///< flags of the active run
    std::optional<QueueGate> gate{};
    /// The report of a run; empty text: there is none.
    std::optional<std::pair<std::uint64_t, std::string>> report{};
    std::optional<bool> rebuilding{};  ///< StoredState::rebuilding
};

/// Everything that a service needs when it starts, except the ended jobs.
struct StoredState {
    std::vector<Job> jobs;  ///< those that wait or print
    JobId next_job_id = 1;
    std::int64_t last_ended = 0;  ///< highest order of an ended job
    std::uint64_t last_run_id = 0;
    std::optional<Run> active_run;      ///< begun, not ended
    std::optional<Run> awaited_report;  ///< ended, its report not yet stored
    QueueGate gate;
    std::string journal_id;   ///< random; made with the journal
    bool rebuilding = false;  ///< it does not know all of its jobs yet (recovery.h)
};

/// Which ended jobs to read, newest first.
struct EndedQuery {
    std::size_t limit = 50;
    /// Jobs that ended before this one; empty: from the newest.
    std::optional<std::int64_t> below_order;
    std::vector<JobState> states;  ///< empty: all that have ended
    std::string text;              ///< a part of the name, in any case; empty: all
};

/// One connection; used from one thread. Operating errors (disk full, damaged file) are Results.
class Store {
  public:
    /// `file` ":memory:" keeps everything in memory. Reads the whole file once, and finds damaged
    /// pages. Errors: corrupt, unavailable, unsupported (a newer schema). A damaged file is left as
    /// it is.
    [[nodiscard]] static Result<std::unique_ptr<Store>> open(const std::filesystem::path& file);
    ~Store();

    [[nodiscard]] Result<StoredState> load();
    [[nodiscard]] Result<std::vector<SessionRecord>> sessions();
    /// Stores all of it durably, or nothing. Errors: unavailable (disk full, I/O), internal.
    [[nodiscard]] Result<void> commit(const Commit& commit);
    /// The newest report of a job. Error: not_found.
    [[nodiscard]] Result<std::string> report_of(JobId job);

    /// Any job, ended ones too. Error: not_found.
    [[nodiscard]] Result<Job> find(JobId id);
    /// Reads no more rows than `limit`, except for a search by name or a state that is rare.
    [[nodiscard]] Result<std::vector<Job>> ended(const EndedQuery& query);
    /// The ended jobs that ended first, oldest first; only those that ended from `from_s` to
    /// `until_s`.
    [[nodiscard]] Result<std::vector<Job>> oldest_ended(
        std::size_t limit, UnixSeconds until_s, UnixSeconds from_s = std::numeric_limits<UnixSeconds>::min());
    /// True when any job has this blob; `except` does not count.
    [[nodiscard]] Result<bool> blob_wanted(const std::string& sha256, JobId except = 0);
    /// Kept up to date by commit().
    [[nodiscard]] const JobCounts& counts() const { return totals_.counts; }
    /// The size of the files of all jobs; shared ones count once.
    [[nodiscard]] std::uint64_t stored_bytes() const { return totals_.stored_bytes; }
    /// Grows with every durable commit.
    [[nodiscard]] std::uint64_t commits() const { return commits_; }

    [[nodiscard]] Result<void> put_session(const SessionRecord& session);
    [[nodiscard]] Result<void> erase_session(const std::string& token_hash);
    /// Erases those that end first, but for `count`. Not by the calendar, which may be wrong: one
    /// that has expired admits nobody, and harms nobody.
    [[nodiscard]] Result<void> keep_sessions(std::size_t count);
    /// The newest time of any job; 0: none.
    [[nodiscard]] Result<UnixSeconds> newest_time();

    /// `make_room` is called when the disk is full, on the store's thread. True: there is room now,
    /// and what failed is done again.
    void when_full(std::function<bool()> make_room);

    /// For a copy that is older than its journal was: holds everything that waits or prints, so
    /// that nothing of it prints again by itself; holds the queue with `reason`; marks the journal
    /// as not knowing all of its jobs.
    [[nodiscard]] Result<void> hold_everything(const std::string& reason);

  private:
    struct Database;
    explicit Store(std::unique_ptr<Database> database);
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
