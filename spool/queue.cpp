#include "spool/queue.h"

#include <algorithm>

namespace qduino::spool {

namespace {

bool prints_before(const Job* a, const Job* b) {
    if (a->priority != b->priority) return a->priority > b->priority;
    if (a->order != b->order) return a->order < b->order;
    return a->id < b->id;
}

bool ended_later(const Job* a, const Job* b) {
    if (a->ended_s != b->ended_s) return a->ended_s > b->ended_s;
    return a->id > b->id;
}

bool is_ended(const Job& job) {
    return job.state == JobState::done || job.state == JobState::cancelled || job.state == JobState::failed;
}

Error no_such_job() { return make_error(ErrorCode::not_found, "there is no job with this number"); }

Result<void> check_numbers(const Job& job) {
    if (job.copies < 1 || job.copies > kMaxCopies) {
        return make_error(ErrorCode::invalid_argument, "copies must be 1 to 1000");
    }
    if (job.priority < -kMaxPriority || job.priority > kMaxPriority) {
        return make_error(ErrorCode::invalid_argument, "priority must be -1000 to 1000");
    }
    return {};
}

/// Length of the well-formed sequence that starts at `text`, 0 when it is none (RFC 3629, section 4).
std::size_t utf8_length(std::string_view text) {
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
    const auto follows = [&](std::size_t i, unsigned low = 0x80, unsigned high = 0xBF) {
        return i < text.size() && byte(i) >= low && byte(i) <= high;
    };
    const unsigned lead = byte(0);
    if (lead < 0x80) return 1;
    if (lead >= 0xC2 && lead <= 0xDF) return follows(1) ? 2 : 0;
    if (lead >= 0xE0 && lead <= 0xEF) {
        const unsigned low = lead == 0xE0 ? 0xA0 : 0x80;
        const unsigned high = lead == 0xED ? 0x9F : 0xBF;
        return follows(1, low, high) && follows(2) ? 3 : 0;
    }
    if (lead >= 0xF0 && lead <= 0xF4) {
        const unsigned low = lead == 0xF0 ? 0x90 : 0x80;
        const unsigned high = lead == 0xF4 ? 0x8F : 0xBF;
        return follows(1, low, high) && follows(2) && follows(3) ? 4 : 0;
    }
    return 0;
}

}  // namespace

std::string_view to_word(JobState state) {
    switch (state) {
        case JobState::queued:
            return "queued";
        case JobState::printing:
            return "printing";
        case JobState::done:
            return "done";
        case JobState::cancelled:
            return "cancelled";
        case JobState::failed:
            return "failed";
    }
    return "failed";
}

bool is_utf8(std::string_view text) {
    while (!text.empty()) {
        const std::size_t length = utf8_length(text);
        if (length == 0) return false;
        text.remove_prefix(length);
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

Queue::Queue(std::vector<Job> jobs, JobId next_id) : jobs_(std::move(jobs)), next_id_(next_id) {
    std::sort(jobs_.begin(), jobs_.end(), [](const Job& a, const Job& b) { return a.id < b.id; });
    if (!jobs_.empty()) next_id_ = std::max(next_id_, jobs_.back().id + 1);
}

const Job* Queue::find(JobId id) const {
    const auto at = std::lower_bound(jobs_.begin(), jobs_.end(), id,
                                     [](const Job& job, JobId wanted) { return job.id < wanted; });
    return at != jobs_.end() && at->id == id ? &*at : nullptr;
}

const Job* Queue::printing() const {
    const auto at = std::find_if(jobs_.begin(), jobs_.end(),
                                 [](const Job& job) { return job.state == JobState::printing; });
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
    for (const Job* job : queued()) all.push_back(job);
    const auto ended_from = static_cast<std::ptrdiff_t>(all.size());
    for (const Job& job : jobs_) {
        if (is_ended(job)) all.push_back(&job);
    }
    std::sort(all.begin() + ended_from, all.end(), ended_later);
    return all;
}

bool Queue::blob_shared(const Job& job) const {
    return std::any_of(jobs_.begin(), jobs_.end(),
                       [&](const Job& other) { return other.id != job.id && other.sha256 == job.sha256; });
}

std::int64_t Queue::last_order() const {
    std::int64_t last = 0;
    for (const Job& job : jobs_) last = std::max(last, job.order);
    return last;
}

Result<Change> Queue::plan_add(Job job) const {
    if (const Result<void> name = check_name(job.name); !name.ok()) return name.error();
    if (const Result<void> numbers = check_numbers(job); !numbers.ok()) return numbers.error();
    job.id = next_id_;
    job.state = JobState::queued;
    job.copies_done = 0;
    job.order = last_order() + 1;
    return Change{{std::move(job)}, {}};
}

Result<Change> Queue::plan_patch(JobId id, const JobPatch& patch) const {
    const Job* found = find(id);
    if (!found) return no_such_job();
    if (patch.move && found->state != JobState::queued) {
        return make_error(ErrorCode::not_permitted, "only a queued job has a place in the queue");
    }
    Job job = *found;
    if (patch.hold) job.hold = *patch.hold;
    if (patch.priority) job.priority = *patch.priority;
    if (patch.copies) job.copies = *patch.copies;
    if (const Result<void> numbers = check_numbers(job); !numbers.ok()) return numbers.error();
    const int in_work = job.state == JobState::queued || job.state == JobState::printing ? 1 : 0;
    if (patch.copies && *patch.copies < job.copies_done + in_work) {
        return make_error(ErrorCode::not_permitted, "so many copies are printed or printing already");
    }
    // More copies of a job that is done are printed: it joins the queue again, at its end.
    if (job.state == JobState::done && job.copies > job.copies_done) {
        job.state = JobState::queued;
        job.order = last_order() + 1;
    }
    Change change;
    if (!patch.move) {
        change.put.push_back(std::move(job));
        return change;
    }
    if (patch.before && *patch.before != id) {
        const Job* other = find(*patch.before);
        if (!other || other->state != JobState::queued) {
            return make_error(ErrorCode::not_found, "the job to stand before is not in the queue");
        }
    }
    plan_move(change, job, patch.before);
    return change;
}

/// The whole queue is numbered anew: it is short, and gaps would run out.
void Queue::plan_move(Change& change, const Job& job, std::optional<JobId> before) const {
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
    change.put = std::move(order);
}

Result<Change> Queue::plan_remove(JobId id) const {
    const Job* found = find(id);
    if (!found) return no_such_job();
    if (found->state == JobState::printing) {
        return make_error(ErrorCode::not_permitted, "the job is printing; cancel it first");
    }
    return Change{{}, {id}};
}

Result<Change> Queue::plan_start(JobId id) const {
    const Job* found = find(id);
    if (!found) return no_such_job();
    if (found->state == JobState::printing) {
        return make_error(ErrorCode::not_permitted, "the job is printing already");
    }
    Job job = *found;
    job.hold = false;
    if (is_ended(job)) {
        if (job.copies_done >= kMaxCopies) {
            return make_error(ErrorCode::not_permitted, "the job was printed 1000 times; upload it again");
        }
        job.state = JobState::queued;
        job.copies = std::max(job.copies, job.copies_done + 1);
        job.order = last_order() + 1;
        job.error.clear();
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
    job.error.clear();
    return Change{{std::move(job)}, {}};
}

Result<Change> Queue::plan_end_copy(JobId id, CopyOutcome outcome, std::string_view error,
                                    UnixSeconds now_s) const {
    const Job* found = find(id);
    if (!found) return no_such_job();
    if (found->state != JobState::printing) {
        return make_error(ErrorCode::not_permitted, "the job is not printing");
    }
    Job job = *found;
    job.ended_s = now_s;
    switch (outcome) {
        case CopyOutcome::completed:
            ++job.copies_done;
            job.state = job.copies_done < job.copies ? JobState::queued : JobState::done;
            break;
        case CopyOutcome::cancelled:
            job.state = JobState::cancelled;
            break;
        case CopyOutcome::failed:
            job.state = JobState::failed;
            job.error = error;
            break;
    }
    return Change{{std::move(job)}, {}};
}

void Queue::apply(const Change& change) {
    for (const Job& job : change.put) {
        const auto at = std::lower_bound(jobs_.begin(), jobs_.end(), job.id,
                                         [](const Job& a, JobId wanted) { return a.id < wanted; });
        if (at != jobs_.end() && at->id == job.id) {
            *at = job;
        } else {
            jobs_.insert(at, job);
        }
        next_id_ = std::max(next_id_, job.id + 1);
    }
    std::erase_if(jobs_, [&](const Job& job) {
        return std::find(change.erase.begin(), change.erase.end(), job.id) != change.erase.end();
    });
}

}  // namespace qduino::spool
