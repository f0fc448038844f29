#include "spool/queue.h"

#include <algorithm>
#include <array>
#include <boost/locale/utf.hpp>
#include <ctime>
#include <tuple>

#include "base/words.h"

namespace qduino::spool {

namespace {

bool prints_before(const Job* a, const Job* b) {
    return std::tuple{-a->priority, a->order, a->id} < std::tuple{-b->priority, b->order, b->id};
}

Result<void> check_numbers(const Job& job) {
    if (job.copies < 1 || job.copies > kMaxCopies) {
        return make_error(ErrorCode::invalid_argument, "copies must be 1 to 1000");
    }
    if (job.priority < -kMaxPriority || job.priority > kMaxPriority) {
        return make_error(ErrorCode::invalid_argument, "priority must be -1000 to 1000");
    }
    return {};
}

/// The job prints again: the end of its last copy no longer describes it.
void forget_end(Job& job) {
    job.error.clear();
    job.stopped_line.reset();
    job.stopped_layer.reset();
    job.stopped_byte.reset();
    job.printed_s.reset();
}

}  // namespace

Error no_such_job() { return make_error(ErrorCode::not_found, "there is no job with this number"); }

std::string utc_text(UnixSeconds time_s, const char* form) {
    const std::time_t time = time_s;
    std::tm parts{};
    std::array<char, 32> text{};
    ::gmtime_r(&time, &parts);
    std::strftime(text.data(), text.size(), form, &parts);
    return text.data();
}

std::string_view to_word(JobState state) {
    static constexpr Words<JobState::queued, JobState::failed> kWords{"queued", "printing", "done",
                                                                      "cancelled", "failed"};
    return kWords(state);
}

bool is_utf8(std::string_view text) {
    namespace utf = boost::locale::utf;
    for (auto at = text.begin(); at != text.end();) {
        const utf::code_point code = utf::utf_traits<char>::decode(at, text.end());
        if (code == utf::illegal || code == utf::incomplete) return false;
    }
    return true;
}

Result<void> check_name(std::string_view name) {
    if (name.empty()) return make_error(ErrorCode::invalid_argument, "the file has no name");
    if (name.size() > 200)
        return make_error(ErrorCode::invalid_argument, "the file name is longer than 200 bytes");
    if (name.find_first_of("/\\") != std::string_view::npos || name == "." || name == "..") {
        return make_error(ErrorCode::invalid_argument, "the file name contains a path; give the bare name");
    }
    const auto is_control = [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; };
    if (std::any_of(name.begin(), name.end(), is_control)) {
        return make_error(ErrorCode::invalid_argument, "the file name contains control characters");
    }
    if (!is_utf8(name)) return make_error(ErrorCode::invalid_argument, "the file name is not UTF-8");
    return {};
}

Queue::Queue(std::vector<Job> jobs, JobId next_id, std::int64_t last_ended)
    : jobs_(std::move(jobs)), next_id_(next_id), last_ended_(last_ended) {
    std::ranges::sort(jobs_, {}, &Job::id);
    if (!jobs_.empty()) next_id_ = std::max(next_id_, jobs_.back().id + 1);
}

const Job* Queue::find(JobId id) const {
    const auto at = std::ranges::lower_bound(jobs_, id, {}, &Job::id);
    return at != jobs_.end() && at->id == id ? &*at : nullptr;
}

const Job* Queue::printing() const {
    const auto at = std::ranges::find(jobs_, JobState::printing, &Job::state);
    return at == jobs_.end() ? nullptr : &*at;
}

std::vector<const Job*> Queue::queued() const {
    std::vector<const Job*> found;
    for (const Job& job : jobs_) {
        if (job.state == JobState::queued) found.push_back(&job);
    }
    std::sort(found.begin(), found.end(), prints_before);
    return found;
}

const Job* Queue::next() const {
    const Job* first = nullptr;
    for (const Job& job : jobs_) {
        if (job.state != JobState::queued || job.hold) continue;
        if (!first || prints_before(&job, first)) first = &job;
    }
    return first;
}

std::vector<const Job*> Queue::listing() const {
    std::vector<const Job*> all;
    if (const Job* job = printing()) all.push_back(job);
    std::ranges::copy(queued(), std::back_inserter(all));
    return all;
}

std::int64_t Queue::last_order() const {
    std::int64_t last = 0;
    for (const Job& job : jobs_) last = std::max(last, job.order);
    return last;
}

/// To the end of its priority.
void Queue::requeue(Job& job) const {
    job.state = JobState::queued;
    job.order = last_order() + 1;
    forget_end(job);
}

Result<Change> Queue::plan_add(Job job) const {
    QDUINO_TRY(check_name(job.name));
    QDUINO_TRY(check_numbers(job));
    job.id = next_id_;
    job.state = JobState::queued;
    job.copies_done = 0;
    job.order = last_order() + 1;
    return Change{{std::move(job)}, {}};
}

Result<Change> Queue::plan_patch(Job job, const JobPatch& patch) const {
    if (patch.move && job.state != JobState::queued) {
        return make_error(ErrorCode::not_permitted, "only a queued job has a place in the queue");
    }
    if (patch.hold) job.hold = *patch.hold;
    if (patch.priority) job.priority = *patch.priority;
    if (patch.copies) job.copies = *patch.copies;
    QDUINO_TRY(check_numbers(job));
    const int in_work = job.state == JobState::queued || job.state == JobState::printing ? 1 : 0;
    if (patch.copies && *patch.copies < job.copies_done + in_work) {
        return make_error(ErrorCode::not_permitted, "so many copies are printed or printing already");
    }
    // A job that is done gets more copies: it joins the queue again, at its end.
    if (job.state == JobState::done && job.copies > job.copies_done) {
        requeue(job);
    }
    if (!patch.move) return Change{{std::move(job)}, {}};
    if (patch.before && *patch.before != job.id) {
        const Job* other = find(*patch.before);
        if (!other || other->state != JobState::queued) {
            return make_error(ErrorCode::not_found, "the job to stand before is not in the queue");
        }
    }
    return plan_move(job, patch.before);
}

/// The whole queue is numbered anew: it is short, and gaps would run out.
Change Queue::plan_move(const Job& job, std::optional<JobId> before) const {
    std::vector<Job> order;
    for (const Job* other : queued()) {
        if (other->id != job.id || before == job.id) order.push_back(other->id == job.id ? job : *other);
    }
    if (before != job.id) {
        const auto at = std::find_if(order.begin(), order.end(),
                                     [&](const Job& other) { return before && other.id == *before; });
        Job moved = job;
        if (at != order.end()) moved.priority = at->priority;
        if (at == order.end() && !order.empty())
            moved.priority = std::min(job.priority, order.back().priority);
        order.insert(at, moved);
    }
    std::int64_t number = last_order();
    for (Job& each : order) each.order = ++number;
    return {std::move(order), {}};
}

Result<Change> Queue::plan_remove(const Job& job) const {
    if (job.state == JobState::printing) {
        return make_error(ErrorCode::not_permitted, "the job is printing; cancel it first");
    }
    return Change{{}, {job.id}};
}

Result<Change> Queue::plan_start(Job job) const {
    if (job.state == JobState::printing) {
        return make_error(ErrorCode::not_permitted, "the job is printing already");
    }
    job.hold = false;
    if (is_ended(job.state)) {
        if (job.copies_done >= kMaxCopies) {
            return make_error(ErrorCode::not_permitted, "the job was printed 1000 times; upload it again");
        }
        job.copies = std::max(job.copies, job.copies_done + 1);
        requeue(job);
    }
    return Change{{std::move(job)}, {}};
}

Result<Change> Queue::plan_begin_copy(JobId id, UnixSeconds now_s) const {
    const Job* found = find(id);
    if (!found) return no_such_job();
    if (found->state != JobState::queued || printing()) {
        return make_error(ErrorCode::not_permitted, "the job is not queued, or another one is printing");
    }
    Job job = *found;
    job.state = JobState::printing;
    job.started_s = now_s;
    job.ended_s = 0;
    forget_end(job);
    return Change{{std::move(job)}, {}};
}

Result<Change> Queue::plan_end_copy(JobId id, const CopyEnd& end, UnixSeconds now_s) const {
    const Job* found = find(id);
    if (!found) return no_such_job();
    if (found->state != JobState::printing) {
        return make_error(ErrorCode::not_permitted, "the job is not printing");
    }
    Job job = *found;
    job.ended_s = now_s;
    switch (end.outcome) {
        case CopyOutcome::completed:
            ++job.copies_done;
            job.state = job.copies_done < job.copies ? JobState::queued : JobState::done;
            break;
        case CopyOutcome::cancelled:
            job.state = JobState::cancelled;
            break;
        case CopyOutcome::failed:
            job.state = JobState::failed;
            job.error = end.error;
            break;
    }
    if (is_ended(job.state)) job.order = last_ended_ + 1;
    job.printed_s = end.printed_s;
    if (end.outcome != CopyOutcome::completed) {
        job.stopped_line = end.stopped_line;
        job.stopped_layer = end.stopped_layer;
        job.stopped_byte = end.stopped_byte;
    }
    return Change{{std::move(job)}, {}};
}

void Queue::remove(JobId id) {
    std::erase_if(jobs_, [id](const Job& job) { return job.id == id; });
}

void Queue::apply(const Change& change) {
    for (const Job& job : change.put) {
        next_id_ = std::max(next_id_, job.id + 1);
        if (is_ended(job.state)) {
            last_ended_ = std::max(last_ended_, job.order);
            remove(job.id);
            continue;
        }
        const auto at = std::ranges::lower_bound(jobs_, job.id, {}, &Job::id);
        if (at != jobs_.end() && at->id == job.id) {
            *at = job;
        } else {
            jobs_.insert(at, job);
        }
    }
    for (const JobId id : change.erase) remove(id);
}

}  // namespace qduino::spool
