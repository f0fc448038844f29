// THE SEAM: jobs, runs and settings. In one SQLite file (disk/sqlite_store.h), or in memory
// (memory_storage.h). tests/unit/spool/storage_contract_test.cpp holds both.
//
// One commit is one fact: it is there whole or absent, and it is safe, as far as the store is,
// before anyone is told of it.
//
// Jobs that wait or print are read once, at the start. There may be a hundred thousand ended ones,
// so these are read when they are asked for, a page at a time.
#pragma once

#include <limits>
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
    std::string journal_id;    ///< random; made with the journal
    bool rebuilding = false;   ///< it does not know all of its jobs yet (disk/recovery.h)
    UnixSeconds newest_s = 0;  ///< the newest time of any job; 0: none
};

/// Which ended jobs to read, newest first.
struct EndedQuery {
    std::size_t limit = 50;
    /// Jobs that ended before this one; empty: from the newest.
    std::optional<std::int64_t> below_order{};
    std::vector<JobState> states{};  ///< empty: all that have ended
    std::string text{};              ///< a part of the name, in any case; empty: all
};

/// Used from one thread. What goes wrong in operation is a Result.
class Store {
  public:
    virtual ~Store() = default;

    [[nodiscard]] virtual Result<StoredState> load() = 0;
    /// Stores all of it, or nothing. Errors: unavailable (no room, I/O), internal (it is against
    /// the rules: a second run, a second job that prints).
    [[nodiscard]] virtual Result<void> commit(const Commit& commit) = 0;

    /// Any job, ended ones too. Error: not_found.
    [[nodiscard]] virtual Result<Job> find(JobId id) = 0;
    /// Reads no more rows than `limit`, except for a search by name or a state that is rare.
    [[nodiscard]] virtual Result<std::vector<Job>> ended(const EndedQuery& query) = 0;
    /// The ended jobs that ended first, oldest first; only those that ended from `from_s` to
    /// `until_s`.
    [[nodiscard]] virtual Result<std::vector<Job>> oldest_ended(
        std::size_t limit, UnixSeconds until_s = std::numeric_limits<UnixSeconds>::max(),
        UnixSeconds from_s = std::numeric_limits<UnixSeconds>::min()) = 0;
    /// True when any job has these bytes; `except` does not count.
    [[nodiscard]] virtual Result<bool> blob_wanted(const std::string& sha256, JobId except = 0) = 0;
    /// The newest report of a job. Error: not_found.
    [[nodiscard]] virtual Result<std::string> report_of(JobId job) = 0;
    [[nodiscard]] virtual JobCounts counts() const = 0;
    /// The size of the files of all jobs; shared ones count once.
    [[nodiscard]] virtual std::uint64_t stored_bytes() const = 0;

    [[nodiscard]] virtual Result<std::vector<SessionRecord>> sessions() = 0;
    [[nodiscard]] virtual Result<void> put_session(const SessionRecord& session) = 0;
    [[nodiscard]] virtual Result<void> erase_session(const std::string& token_hash) = 0;
    /// Erases those that end first, but for `count`. Not by the calendar, which may be wrong: one
    /// that has expired admits nobody, and harms nobody.
    [[nodiscard]] virtual Result<void> keep_sessions(std::size_t count) = 0;
};

}  // namespace qduino::spool
