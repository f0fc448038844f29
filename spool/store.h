// The journal: jobs, runs and settings in one SQLite file, every commit durable before it is spoken of.
//
// WAL with synchronous=FULL: commit() returns after the log is on the disk. One transaction is one fact: a power cut
// leaves it whole or absent. (SQLite, "Write-Ahead Logging" and "PRAGMA synchronous".)
//
//   jobs      one row a job                                       runs      one row an attempt to print a copy
//   settings  key → value: next job id, hold of the queue …       sessions  SHA-256 of a browser's cookie → expiry
#pragma once

#include <filesystem>
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

/// What printing waits for besides a ready machine.
struct QueueGate {
    std::string hold_reason;  ///< the queue is held, for this reason; empty: it is not
    bool bed_occupied = false;
};

/// One transaction. Empty parts change nothing.
struct Commit {
    Change jobs;
    std::optional<Run> run_begun;
    struct RunEnd {
        std::uint64_t run = 0;
        std::string outcome;  ///< completed, cancelled, failed
        UnixSeconds ended_s = 0;
    };
    std::optional<RunEnd> run_ended;
    std::optional<Run> run_changed;  ///< flags of the active run
    std::optional<QueueGate> gate;
    std::optional<std::pair<std::uint64_t, std::string>> report;  ///< of a run; empty text: there is none
};

/// Everything that a service needs when it starts.
struct StoredState {
    std::vector<Job> jobs;
    JobId next_job_id = 1;
    std::uint64_t last_run_id = 0;
    std::optional<Run> active_run;      ///< begun, not ended
    std::optional<Run> awaited_report;  ///< ended, its report not yet stored
    QueueGate gate;
    std::vector<SessionRecord> sessions;
};

/// One connection; used from one thread. Operating errors (disk full, damaged file) are Results.
class Store {
  public:
    /// `file` ":memory:" keeps everything in memory. Errors: corrupt, unavailable, unsupported (a newer schema).
    [[nodiscard]] static Result<std::unique_ptr<Store>> open(const std::filesystem::path& file);
    ~Store();

    [[nodiscard]] Result<StoredState> load();
    /// All of it durably, or nothing. Errors: unavailable (disk full, I/O), internal.
    [[nodiscard]] Result<void> commit(const Commit& commit);
    /// The newest report of a job. Error: not_found.
    [[nodiscard]] Result<std::string> report_of(JobId job);

    [[nodiscard]] Result<void> put_session(const SessionRecord& session);
    [[nodiscard]] Result<void> erase_session(const std::string& token_hash);
    [[nodiscard]] Result<void> erase_sessions_expired(UnixSeconds now_s);

  private:
    struct Database;
    explicit Store(std::unique_ptr<Database> database);
    std::unique_ptr<Database> database_;
};

}  // namespace qduino::spool
