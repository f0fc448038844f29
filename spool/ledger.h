// The ledger: what a commit must find whole. The queue, the gate that printing waits at, and the
// store that holds both, with the lines that tell of it.
//
//   plan (queue.h) ──► Store.commit, durable ──► apply: visible
//
// On the spool's thread.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "base/result.h"
#include "base/text.h"
#include "spool/queue.h"
#include "spool/storage.h"

namespace qduino::spool {

/// How a person knows it: number and name.
[[nodiscard]] inline std::string words_of(const Job& job) {
    return text<std::string>("job ", job.id, " (", job.name, ")");
}

/// Lines for the log. A line that repeats (a full disk, say) is there once.
class LogLines {
  public:
    template <typename... Pieces>
    void add(const Pieces&... pieces) {
        std::string line = text<std::string>(pieces...);
        if (line == last_) return;
        last_ = line;
        lines_.push_back(std::move(line));
    }
    /// Those since the last call.
    [[nodiscard]] std::vector<std::string> take() { return std::exchange(lines_, {}); }

  private:
    std::vector<std::string> lines_;
    std::string last_;
};

class Ledger {
  public:
    /// `storage` outlives this.
    explicit Ledger(Storage& storage) : storage_(storage) {}
    /// Takes over what the store knows.
    void load(std::vector<Job> jobs, JobId next_id, std::int64_t last_ended, QueueGate gate) {
        queue_ = Queue{std::move(jobs), next_id, last_ended};
        gate_ = std::move(gate);
    }

    [[nodiscard]] Storage& storage() const { return storage_; }
    [[nodiscard]] Store& store() const { return storage_.store(); }
    [[nodiscard]] Files& files() const { return storage_.files(); }
    [[nodiscard]] const Queue& queue() const { return queue_; }
    [[nodiscard]] const QueueGate& gate() const { return gate_; }
    [[nodiscard]] std::uint64_t revision() const { return revision_; }
    [[nodiscard]] LogLines& log() { return log_; }
    /// Any job. Error: not_found.
    [[nodiscard]] Result<Job> find(JobId id) const {
        if (const Job* live = queue_.find(id)) return *live;
        return store().find(id);
    }

    /// Errors: Store::commit's; then nothing has changed.
    [[nodiscard]] Result<void> commit(const Commit& changes) {
        QDUINO_TRY(store().commit(changes));
        queue_.apply(changes.jobs);
        if (changes.gate) gate_ = *changes.gate;
        ++revision_;
        return {};
    }
    [[nodiscard]] Result<void> commit(Result<Change> change) {
        if (!change) return change.error();
        return commit(Commit{.jobs = std::move(*change)});
    }
    /// A commit that may fail: the log says why.
    [[nodiscard]] bool try_commit(const Commit& changes) {
        const Result<void> done = commit(changes);
        if (!done) log_.add(done.error().message);
        return done.ok();
    }
    /// An empty reason releases it.
    [[nodiscard]] Result<void> hold_queue(std::string reason) {
        return commit(Commit{.gate = QueueGate{std::move(reason), gate_.bed_occupied}});
    }

  private:
    Storage& storage_;
    Queue queue_;
    QueueGate gate_;
    std::uint64_t revision_ = 1;
    LogLines log_;
};

}  // namespace qduino::spool
