// The queue: the jobs that wait or print, their order, and the changes that are allowed. Pure.
//
// An ended job is no longer in here (store.h has it). The queue still decides what may become of
// it: every plan takes the job as it stands, wherever the caller found it.
//
// A power cut must not take back what a person was told. So a change is planned, made durable by
// the caller, and only then applied:
//
//     Result<Change> change = queue.plan_…(…);      nothing differs yet; refused with the reason
//     store.commit(change);                         on the disk
//     queue.apply(change);                          visible
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "spool/job.h"

namespace qduino::spool {

/// A plan's effect on the set of jobs: whole rows.
struct Change {
    std::vector<Job> put;  ///< new or replaced, by id; one that has ended leaves the queue
    std::vector<JobId> erase;
};

/// What a person may change. Unset: left as it is.
struct JobPatch {
    std::optional<bool> hold;
    std::optional<int> copies;
    std::optional<int> priority;
    bool move = false;  ///< whether `before` is meant
    /// The job to stand in front of, whose priority it takes; empty: the queue's end.
    std::optional<JobId> before;
};

/// How a copy ended.
enum class CopyOutcome : std::uint8_t { completed, cancelled, failed };

struct CopyEnd {
    CopyOutcome outcome = CopyOutcome::completed;
    std::string error;  ///< why it failed
    /// The line at which it failed or was cancelled; empty: unknown.
    std::optional<std::int64_t> stopped_line;
    std::optional<std::int64_t> stopped_layer;   ///< likewise
    std::optional<std::int64_t> stopped_byte{};  ///< likewise: so many were executed
    /// The printer's time, pauses excluded; empty: unknown.
    std::optional<std::int64_t> printed_s{};
};

class Queue {
  public:
    Queue() = default;
    /// `jobs` wait or print. `next_id` is above the id of every job that ever was: an id is never
    /// used twice. `last_ended` is the highest `order` of an ended job.
    Queue(std::vector<Job> jobs, JobId next_id, std::int64_t last_ended = 0);

    [[nodiscard]] const Job* find(JobId id) const;
    [[nodiscard]] const Job* printing() const;
    /// The job whose copy prints next: the first queued one that is not held; null when there is
    /// none.
    [[nodiscard]] const Job* next() const;
    /// Queued jobs in the order they print, held ones included in their places.
    [[nodiscard]] std::vector<const Job*> queued() const;
    /// The printing job, then the queue in its order.
    [[nodiscard]] std::vector<const Job*> listing() const;
    [[nodiscard]] std::size_t size() const { return jobs_.size(); }
    [[nodiscard]] JobId next_id() const { return next_id_; }
    [[nodiscard]] std::span<const Job> jobs() const { return jobs_; }

    /// A new job at the end of its priority. `job` carries everything except id, state and order.
    /// Errors: invalid_argument.
    [[nodiscard]] Result<Change> plan_add(Job job) const;
    /// Errors: not_found (`before` is not in the queue), invalid_argument, not_permitted (does not
    /// apply in its state).
    [[nodiscard]] Result<Change> plan_patch(Job job, const JobPatch& patch) const;
    /// Error: not_permitted (it prints).
    [[nodiscard]] Result<Change> plan_remove(const Job& job) const;
    /// Releases a held job, or queues an ended one for one more copy. Error: not_permitted (it
    /// prints).
    [[nodiscard]] Result<Change> plan_start(Job job) const;
    /// Errors: not_found, not_permitted (not queued, or another one prints).
    [[nodiscard]] Result<Change> plan_begin_copy(JobId id, UnixSeconds now_s) const;
    /// Errors: not_found, not_permitted (it does not print).
    [[nodiscard]] Result<Change> plan_end_copy(JobId id, const CopyEnd& end, UnixSeconds now_s) const;

    void apply(const Change& change);

  private:
    [[nodiscard]] std::int64_t last_order() const;
    void remove(JobId id);
    [[nodiscard]] Change plan_move(const Job& job, std::optional<JobId> before) const;
    void requeue(Job& job) const;

    std::vector<Job> jobs_;  // by id
    JobId next_id_ = 1;
    std::int64_t last_ended_ = 0;
};

/// The error for a number that is no job's.
[[nodiscard]] Error no_such_job();

/// A name that is safe to show and to store: UTF-8, 1 to 200 bytes, no control characters, no path.
/// Errors: invalid_argument, saying what is wrong without repeating the name.
[[nodiscard]] Result<void> check_name(std::string_view name);

/// True when `text` is well-formed UTF-8 (RFC 3629: no overlong forms, no surrogates).
[[nodiscard]] bool is_utf8(std::string_view text);

}  // namespace qduino::spool
