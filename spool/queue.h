// The queue: every job, the order in which they print, and which changes are allowed. Pure.
//
// Every change is planned, made durable by the caller, and only then applied:
//
//     Result<Change> change = queue.plan_…(…);      nothing is different yet; refused with the reason
//     store.commit(change);                         on the disk
//     queue.apply(change);                          visible
//
// so that nobody is told of a state that a power cut could take back.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "base/result.h"
#include "spool/job.h"

namespace qduino::spool {

/// What a plan does to the set of jobs: whole rows.
struct Change {
    std::vector<Job> put;  ///< new or replaced, by id
    std::vector<JobId> erase;
};

/// What a person may change. Unset: left as it is.
struct JobPatch {
    std::optional<bool> hold;
    std::optional<int> copies;
    std::optional<int> priority;
    bool move = false;  ///< whether `before` is meant
    std::optional<JobId>
        before;  ///< the job to stand in front of, whose priority it takes; empty: the queue's end
};

/// How a copy ended.
enum class CopyOutcome : std::uint8_t { completed, cancelled, failed };

class Queue {
  public:
    Queue() = default;
    /// `next_id` is above the id of every job that ever was: an id is never used twice.
    Queue(std::vector<Job> jobs, JobId next_id);

    [[nodiscard]] const Job* find(JobId id) const;
    [[nodiscard]] const Job* printing() const;
    /// The job whose copy prints next: the first queued one that is not held; null when there is none.
    [[nodiscard]] const Job* next() const;
    /// Queued jobs in the order they print, held ones included in their places.
    [[nodiscard]] std::vector<const Job*> queued() const;
    /// The printing job, then the queue in its order, then the ended, newest first.
    [[nodiscard]] std::vector<const Job*> listing() const;
    [[nodiscard]] std::size_t size() const { return jobs_.size(); }
    /// True when another job uses the same blob.
    [[nodiscard]] bool blob_shared(const Job& job) const;

    /// A new job at the end of its priority; `job` carries all but id, state, order. Errors: invalid_argument.
    [[nodiscard]] Result<Change> plan_add(Job job) const;
    /// Errors: not_found, invalid_argument, not_permitted (does not apply in its state).
    [[nodiscard]] Result<Change> plan_patch(JobId id, const JobPatch& patch) const;
    /// Errors: not_found, not_permitted (it prints).
    [[nodiscard]] Result<Change> plan_remove(JobId id) const;
    /// Releases a held job, or queues an ended one for one more copy. Errors: not_found, not_permitted (it prints).
    [[nodiscard]] Result<Change> plan_start(JobId id) const;
    /// Errors: not_found, not_permitted (not queued, or another one prints).
    [[nodiscard]] Result<Change> plan_begin_copy(JobId id, UnixSeconds now_s) const;
    /// `error` says why, when failed. Errors: not_found, not_permitted (it does not print).
    [[nodiscard]] Result<Change> plan_end_copy(JobId id, CopyOutcome outcome, std::string_view error,
                                               UnixSeconds now_s) const;

    void apply(const Change& change);

  private:
    [[nodiscard]] std::int64_t last_order() const;
    void plan_move(Change& change, const Job& job, std::optional<JobId> before) const;

    std::vector<Job> jobs_;  // by id
    JobId next_id_ = 1;
};

/// A name that is safe to show and to store: UTF-8, 1 to 200 bytes, no control characters, no path.
/// Errors: invalid_argument, saying what is wrong without repeating the name.
[[nodiscard]] Result<void> check_name(std::string_view name);

/// Whether `text` is well-formed UTF-8 (RFC 3629: no overlong forms, no surrogates).
[[nodiscard]] bool is_utf8(std::string_view text);

}  // namespace qduino::spool
