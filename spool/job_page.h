// The list of jobs that a person sees, a page at a time: what prints and waits is in the queue, and
// what has ended is in the store.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "spool/queue.h"
#include "spool/store.h"

namespace qduino::spool {

/// The jobs that a person wants to see, in the order of the list: printing, waiting in the queue's
/// order, ended with the newest first.
struct JobQuery {
    static constexpr std::size_t kLimitMax = 1000;

    std::size_t limit = 50;
    std::optional<JobId> before;  ///< what stands behind this one; an unknown one: from the start
    /// The states wanted.
    bool waiting = true, held = true, printing = true, done = true, cancelled = true, failed = true;
    std::string text;  ///< a part of the name, in any case
    /// The first page has every printing job, the first kFirstWaiting that wait, and `limit` of the
    /// ended.
    static constexpr std::size_t kFirstWaiting = 100;
    [[nodiscard]] bool is_first_page() const {
        return !before && text.empty() && waiting && held && printing && done && cancelled && failed;
    }
};

struct JobPage {
    std::vector<Job> jobs;
    std::optional<JobId> next_before;  ///< the next page stands behind it; empty: there is none
};

/// Reads no more rows than it returns, except for a search. Error: as Store::ended.
[[nodiscard]] Result<JobPage> page_of(const Queue& queue, Store& store, const JobQuery& query);

}  // namespace qduino::spool
