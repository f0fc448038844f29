#include "spool/queue.h"

#include <algorithm>

#include "base/words.h"

namespace qduino::spool {

namespace {

bool prints_before(const Job* a, const Job* b) {
    if (a->priority != b->priority) return a->priority > b->priority;
    if (a->order != b->order) return a->order < b->order;
    return a->id < b->id;
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
}

/// Length of the well-formed sequence that starts at `text`, 0 when it is none (RFC 3629, section
/// 4).
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

Error no_such_job() { return make_error(ErrorCode::not_found, "there is no job with this number"); }

std::string_view to_word(JobState state) {
    static constexpr Words<JobState::queued, JobState::failed> kWords{"queued", "printing", "done",
                                                                      "cancelled", "failed"};
    return kWords(state);
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

Queue::Queue(std::vector<Job> jobs, JobId next_id, std::int64_t last_ended)
    : jobs_(std::move(jobs)), next_id_(next_id), last_ended_(last_ended) {
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
    return all;
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

Result<Change> Queue::plan_patch(Job job, const JobPatch& patch) const {
    if (patch.move && job.state != JobState::queued) {
        return make_error(ErrorCode::not_permitted, "only a queued job has a place in the queue");
    }
    if (patch.hold) job.hold = *patch.hold;
    if (patch.priority) job.priority = *patch.priority;
    if (patch.copies) job.copies = *patch.copies;
    if (const Result<void> numbers = check_numbers(job); !numbers.ok()) return numbers.error();
    const int in_work = job.state == JobState::queued || job.state == JobState::printing ? 1 : 0;
    if (patch.copies && *patch.copies < job.copies_done + in_work) {
        return make_error(ErrorCode::not_permitted, "so many copies are printed or printing already");
    }
    // A job that is done gets more copies: it joins the queue again, at its end.
    if (job.state == JobState::done && job.copies > job.copies_done) {
        job.state = JobState::queued;
        job.order = last_order() + 1;
        forget_end(job);
    }
    Change change;
    if (!patch.move) {
        change.put.push_back(std::move(job));
        return change;
    }
    if (patch.before && *patch.before != job.id) {
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
        job.state = JobState::queued;
        job.copies = std::max(job.copies, job.copies_done + 1);
        job.order = last_order() + 1;
        forget_end(job);
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
    if (end.outcome != CopyOutcome::completed) {
        job.stopped_line = end.stopped_line;
        job.stopped_layer = end.stopped_layer;
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
        const auto at = std::lower_bound(jobs_.begin(), jobs_.end(), job.id,
                                         [](const Job& a, JobId wanted) { return a.id < wanted; });
        if (at != jobs_.end() && at->id == job.id) {
            *at = job;
        } else {
            jobs_.insert(at, job);
        }
    }
    for (const JobId id : change.erase) remove(id);
}

}  // namespace qduino::spool
