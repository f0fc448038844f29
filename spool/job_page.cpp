#include "spool/job_page.h"

#include <algorithm>
#include <iterator>

#include "spool/name_search.h"

namespace qduino::spool {

namespace {

bool matches(const Job& job, const JobQuery& query, const std::string& folded_text) {
    const bool state = job.state == JobState::printing ? query.printing
                       : job.hold                      ? query.held
                                                       : query.waiting;
    return state && (folded_text.empty() || name_holds(job.name, folded_text));
}

/// The ended jobs that `query` wants; nothing when it wants none.
std::optional<EndedQuery> ended_query(const JobQuery& query) {
    EndedQuery ended;
    if (query.done) ended.states.push_back(JobState::done);
    if (query.cancelled) ended.states.push_back(JobState::cancelled);
    if (query.failed) ended.states.push_back(JobState::failed);
    if (ended.states.empty()) return std::nullopt;
    if (ended.states.size() == 3) ended.states.clear();
    ended.text = query.text;
    return ended;
}

}  // namespace

Result<JobPage> page_of(const Queue& queue, Store& store, const JobQuery& query) {
    JobPage page;
    const std::vector<const Job*> live = queue.listing();
    auto from = live.begin();
    std::optional<std::int64_t> below_order;
    if (query.before) {
        const auto at = std::ranges::find(live, *query.before, &Job::id);
        if (at != live.end()) {
            from = at + 1;
        } else if (const Result<Job> ended = store.find(*query.before); ended.ok()) {
            from = live.end();
            below_order = ended->order;
        } else if (ended.error().code != ErrorCode::not_found) {
            return ended.error();
        }
    }
    const bool first = query.is_first_page();
    std::size_t waiting = 0;
    const std::string text = folded(query.text);
    for (; from != live.end() && (first || page.jobs.size() <= query.limit); ++from) {
        if (!matches(**from, query, text)) continue;
        if (first && (*from)->state == JobState::queued && ++waiting > JobQuery::kFirstWaiting) continue;
        page.jobs.push_back(**from);
    }
    const std::size_t limit = query.limit + (first ? page.jobs.size() : 0);
    std::optional<EndedQuery> ended = ended_query(query);
    if (ended && page.jobs.size() <= limit) {
        ended->below_order = below_order;
        // One more, to learn whether there is a next page.
        ended->limit = limit + 1 - page.jobs.size();
        QDUINO_TRY_ASSIGN(std::vector<Job> rows, store.ended(*ended));
        std::ranges::move(rows, std::back_inserter(page.jobs));
    }
    if (page.jobs.size() <= limit) return page;
    page.jobs.resize(limit);
    page.next_before = page.jobs.back().id;
    return page;
}

}  // namespace qduino::spool
