// The queue as a state machine: every allowed change, every refused one, and random sequences
// against a naive oracle.
#include "spool/queue.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>

namespace qduino::spool::queue_test {
namespace {

using ::testing::ElementsAre;

Job wanted(std::string name, int copies = 1, int priority = 0) {
    Job job;
    job.name = std::move(name);
    job.copies = copies;
    job.priority = priority;
    job.sha256 = "00";
    return job;
}

/// The queue with what keeps its ended jobs, as the store does: every job by its number.
class Jobs {
  public:
    Jobs() = default;
    Jobs(std::vector<Job> jobs, JobId next_id) : queue_(std::move(jobs), next_id) {}

    [[nodiscard]] const Job* find(JobId id) const {
        if (const Job* live = queue_.find(id)) return live;
        const auto at = ended_.find(id);
        return at == ended_.end() ? nullptr : &at->second;
    }
    [[nodiscard]] const Job* printing() const { return queue_.printing(); }
    [[nodiscard]] const Job* next() const { return queue_.next(); }
    [[nodiscard]] std::vector<const Job*> queued() const { return queue_.queued(); }
    [[nodiscard]] std::vector<const Job*> listing() const {
        std::vector<const Job*> all = queue_.listing();
        std::vector<const Job*> ended;
        for (const auto& [id, job] : ended_) ended.push_back(&job);
        std::sort(ended.begin(), ended.end(), [](const Job* a, const Job* b) { return a->order > b->order; });
        all.insert(all.end(), ended.begin(), ended.end());
        return all;
    }
    [[nodiscard]] std::size_t size() const { return queue_.size() + ended_.size(); }
    [[nodiscard]] Result<Change> plan_add(Job job) const { return queue_.plan_add(std::move(job)); }
    [[nodiscard]] Result<Change> plan_patch(JobId id, const JobPatch& patch) const {
        return find(id) ? queue_.plan_patch(*find(id), patch) : no_such_job();
    }
    [[nodiscard]] Result<Change> plan_remove(JobId id) const {
        return find(id) ? queue_.plan_remove(*find(id)) : no_such_job();
    }
    [[nodiscard]] Result<Change> plan_start(JobId id) const {
        return find(id) ? queue_.plan_start(*find(id)) : no_such_job();
    }
    [[nodiscard]] Result<Change> plan_begin_copy(JobId id, UnixSeconds now_s) const {
        return queue_.plan_begin_copy(id, now_s);
    }
    [[nodiscard]] Result<Change> plan_end_copy(JobId id, CopyOutcome outcome, std::string error,
                                               UnixSeconds now_s) const {
        return queue_.plan_end_copy(id, {outcome, std::move(error), 12, 3, 400, 50}, now_s);
    }
    void apply(const Change& change) {
        queue_.apply(change);
        for (const Job& job : change.put) {
            ended_.erase(job.id);
            if (is_ended(job.state)) ended_[job.id] = job;
        }
        for (const JobId id : change.erase) ended_.erase(id);
    }

  private:
    Queue queue_;
    std::map<JobId, Job> ended_;
};

JobId add(Jobs& queue, Job job) {
    const Result<Change> change = queue.plan_add(std::move(job));
    EXPECT_TRUE(change.ok());
    queue.apply(*change);
    return change->put.front().id;
}

void apply(Jobs& queue, const Result<Change>& change) {
    ASSERT_TRUE(change.ok()) << change.error().message.view();
    queue.apply(*change);
}

std::vector<JobId> order(const Jobs& queue) {
    std::vector<JobId> ids;
    for (const Job* job : queue.queued()) ids.push_back(job->id);
    return ids;
}

std::vector<JobId> listed(const Jobs& queue) {
    std::vector<JobId> ids;
    for (const Job* job : queue.listing()) ids.push_back(job->id);
    return ids;
}

JobPatch move_before(std::optional<JobId> before) {
    JobPatch patch;
    patch.move = true;
    patch.before = before;
    return patch;
}

TEST(Queue, PrintsByPriorityThenByArrival) {
    Jobs queue;
    const JobId a = add(queue, wanted("a"));
    const JobId b = add(queue, wanted("b", 1, 5));
    const JobId c = add(queue, wanted("c"));
    EXPECT_THAT(order(queue), ElementsAre(b, a, c));
    EXPECT_EQ(queue.next()->id, b);
}

TEST(Queue, PlanningChangesNothing) {
    Jobs queue;
    const JobId a = add(queue, wanted("a"));
    ASSERT_TRUE(queue.plan_remove(a).ok());
    ASSERT_TRUE(queue.plan_begin_copy(a, 1).ok());
    EXPECT_EQ(queue.find(a)->state, JobState::queued);
}

TEST(Queue, CopiesPrintOneAfterAnother) {
    Jobs queue;
    const JobId a = add(queue, wanted("a", 2));
    for (int copy = 1; copy <= 2; ++copy) {
        apply(queue, queue.plan_begin_copy(a, 10 * copy));
        EXPECT_EQ(queue.printing()->id, a);
        EXPECT_EQ(queue.next(), nullptr);
        apply(queue, queue.plan_end_copy(a, CopyOutcome::completed, "", 10 * copy + 5));
    }
    EXPECT_EQ(queue.find(a)->state, JobState::done);
    EXPECT_EQ(queue.find(a)->copies_done, 2);
    EXPECT_EQ(queue.find(a)->ended_s, 25);
}

TEST(Queue, AHeldJobKeepsItsPlaceAndIsPassedOver) {
    Jobs queue;
    const JobId a = add(queue, wanted("a"));
    const JobId b = add(queue, wanted("b"));
    JobPatch hold;
    hold.hold = true;
    apply(queue, queue.plan_patch(a, hold));
    EXPECT_EQ(queue.next()->id, b);
    apply(queue, queue.plan_start(a));
    EXPECT_EQ(queue.next()->id, a);
}

TEST(Queue, MovesBeforeAnotherAndTakesItsPriority) {
    Jobs queue;
    const JobId a = add(queue, wanted("a", 1, 5));
    const JobId b = add(queue, wanted("b"));
    const JobId c = add(queue, wanted("c"));
    apply(queue, queue.plan_patch(c, move_before(a)));
    EXPECT_THAT(order(queue), ElementsAre(c, a, b));
    EXPECT_EQ(queue.find(c)->priority, 5);
    apply(queue, queue.plan_patch(a, move_before(std::nullopt)));
    EXPECT_THAT(order(queue), ElementsAre(c, b, a));
    apply(queue, queue.plan_patch(b, move_before(b)));
    EXPECT_THAT(order(queue), ElementsAre(c, b, a)) << "before itself: nothing moves";
    const JobId d = add(queue, wanted("d"));
    EXPECT_EQ(order(queue).back(), d) << "newcomers still go last";
}

TEST(Queue, OnlyQueuedJobsMove) {
    Jobs queue;
    const JobId a = add(queue, wanted("a"));
    const JobId b = add(queue, wanted("b"));
    apply(queue, queue.plan_begin_copy(a, 1));
    EXPECT_EQ(queue.plan_patch(a, move_before(b)).error().code, ErrorCode::not_permitted);
    EXPECT_EQ(queue.plan_patch(b, move_before(a)).error().code, ErrorCode::not_found);
    EXPECT_EQ(queue.plan_patch(b, move_before(99)).error().code, ErrorCode::not_found);
}

TEST(Queue, ThePrintingJobCannotBeRemovedStartedOrJoinedByAnother) {
    Jobs queue;
    const JobId a = add(queue, wanted("a"));
    const JobId b = add(queue, wanted("b"));
    apply(queue, queue.plan_begin_copy(a, 1));
    EXPECT_EQ(queue.plan_remove(a).error().code, ErrorCode::not_permitted);
    EXPECT_EQ(queue.plan_start(a).error().code, ErrorCode::not_permitted);
    EXPECT_EQ(queue.plan_begin_copy(b, 2).error().code, ErrorCode::not_permitted);
    EXPECT_EQ(queue.plan_end_copy(b, CopyOutcome::completed, "", 2).error().code, ErrorCode::not_permitted);
}

TEST(Queue, AFailedJobKeepsItsReasonUntilItIsStartedAgain) {
    Jobs queue;
    const JobId a = add(queue, wanted("a"));
    apply(queue, queue.plan_begin_copy(a, 1));
    apply(queue, queue.plan_end_copy(a, CopyOutcome::failed, "thermistor stuck", 9));
    EXPECT_EQ(queue.find(a)->error, "thermistor stuck");
    EXPECT_EQ(queue.find(a)->stopped_line, 12);
    EXPECT_EQ(queue.find(a)->stopped_layer, 3);
    EXPECT_EQ(queue.find(a)->stopped_byte, 400);
    EXPECT_EQ(queue.find(a)->printed_s, 50);
    EXPECT_EQ(queue.next(), nullptr);
    apply(queue, queue.plan_start(a));
    EXPECT_EQ(queue.find(a)->state, JobState::queued);
    EXPECT_EQ(queue.find(a)->error, "");
    EXPECT_FALSE(queue.find(a)->stopped_line || queue.find(a)->stopped_layer);
    EXPECT_FALSE(queue.find(a)->stopped_byte || queue.find(a)->printed_s);
    EXPECT_EQ(queue.find(a)->copies, 1) << "the failed copy was not done";
}

TEST(Queue, AFinishedJobStartedAgainPrintsOneMoreCopy) {
    Jobs queue;
    const JobId a = add(queue, wanted("a"));
    apply(queue, queue.plan_begin_copy(a, 1));
    apply(queue, queue.plan_end_copy(a, CopyOutcome::completed, "", 2));
    apply(queue, queue.plan_start(a));
    EXPECT_EQ(queue.find(a)->copies, 2);
    EXPECT_EQ(queue.next()->id, a);
}

TEST(Queue, MoreCopiesOfAFinishedJobQueueItAgain) {
    Jobs queue;
    const JobId a = add(queue, wanted("a"));
    apply(queue, queue.plan_begin_copy(a, 1));
    apply(queue, queue.plan_end_copy(a, CopyOutcome::completed, "", 2));
    JobPatch more;
    more.copies = 3;
    apply(queue, queue.plan_patch(a, more));
    EXPECT_EQ(queue.find(a)->state, JobState::queued);
    more.copies = 1;
    EXPECT_EQ(queue.plan_patch(a, more).error().code, ErrorCode::not_permitted)
        << "one is done, one is queued";
}

TEST(Queue, ListsThePrintingThenTheQueueThenTheNewestEnded) {
    Jobs queue;
    const JobId a = add(queue, wanted("a"));
    const JobId b = add(queue, wanted("b"));
    const JobId c = add(queue, wanted("c"));
    const JobId d = add(queue, wanted("d"));
    apply(queue, queue.plan_begin_copy(a, 1));
    apply(queue, queue.plan_end_copy(a, CopyOutcome::completed, "", 2));
    apply(queue, queue.plan_begin_copy(b, 3));
    apply(queue, queue.plan_end_copy(b, CopyOutcome::cancelled, "", 4));
    apply(queue, queue.plan_begin_copy(d, 5));
    EXPECT_THAT(listed(queue), ElementsAre(d, c, b, a));
}

TEST(Queue, WhatEndedLastIsListedFirstWhateverTheClockSays) {
    Jobs queue;
    const JobId a = add(queue, wanted("a"));
    const JobId b = add(queue, wanted("b"));
    apply(queue, queue.plan_begin_copy(b, 100));
    apply(queue, queue.plan_end_copy(b, CopyOutcome::completed, "", 200));
    apply(queue, queue.plan_begin_copy(a, 50));  // the clock was set back
    apply(queue, queue.plan_end_copy(a, CopyOutcome::failed, "emergency stop", 60));
    EXPECT_THAT(listed(queue), ElementsAre(a, b));
    apply(queue, queue.plan_start(b));
    apply(queue, queue.plan_begin_copy(b, 60));
    apply(queue, queue.plan_end_copy(b, CopyOutcome::failed, "again", 60));
    EXPECT_THAT(listed(queue), ElementsAre(b, a)) << "in the same second";
}

TEST(Queue, NumbersAreNeverUsedTwice) {
    Jobs queue{{}, 8};
    const JobId a = add(queue, wanted("a"));
    EXPECT_EQ(a, 8);
    apply(queue, queue.plan_remove(a));
    EXPECT_EQ(add(queue, wanted("b")), 9);
}

TEST(Queue, RefusesNumbersOutOfRange) {
    Jobs queue;
    EXPECT_FALSE(queue.plan_add(wanted("a", 0)).ok());
    EXPECT_FALSE(queue.plan_add(wanted("a", 1001)).ok());
    EXPECT_FALSE(queue.plan_add(wanted("a", 1, 1001)).ok());
    EXPECT_FALSE(queue.plan_add(wanted("a", 1, -1001)).ok());
    EXPECT_EQ(queue.plan_patch(1, {}).error().code, ErrorCode::not_found);
    EXPECT_EQ(queue.plan_start(1).error().code, ErrorCode::not_found);
    EXPECT_EQ(queue.plan_remove(1).error().code, ErrorCode::not_found);
}

TEST(JobName, MayBeAnyTextButNotAPath) {
    EXPECT_TRUE(check_name("benchy.gcode").ok());
    EXPECT_TRUE(check_name("Prüfstück 3 (½).gcode").ok());
    EXPECT_TRUE(check_name("<b>x").ok()) << "text is text; the page escapes it";
    for (const std::string_view bad :
         {"", ".", "..", "../x", "a/b", "a\\b", "..\\x", "/etc/passwd", "a\nb", "a\x7f"}) {
        EXPECT_FALSE(check_name(bad).ok()) << bad;
    }
    EXPECT_FALSE(check_name(std::string_view{"a\0b", 3}).ok());
    EXPECT_FALSE(check_name(std::string(201, 'a')).ok());
    EXPECT_FALSE(check_name("\xC0\xAF").ok()) << "an overlong slash";
    EXPECT_FALSE(check_name("\xED\xA0\x80").ok()) << "a surrogate";
    EXPECT_FALSE(check_name("\xFF").ok());
    EXPECT_FALSE(check_name("\xE2\x82").ok()) << "cut short";
}

/// The oracle: a plain list of what should be true after each step, recomputed the slow way.
struct Oracle {
    struct Entry {
        int left = 0, done = 0;
        bool ended = false, printing = false, hold = false;
    };
    std::map<JobId, Entry> jobs;
    [[nodiscard]] int printing() const {
        int count = 0;
        for (const auto& [id, entry] : jobs) count += entry.printing ? 1 : 0;
        return count;
    }
};

void check(const Jobs& queue, const Oracle& oracle, std::uint64_t seed) {
    ASSERT_EQ(queue.size(), oracle.jobs.size()) << "seed " << seed;
    ASSERT_EQ(queue.listing().size(), oracle.jobs.size()) << "seed " << seed;
    ASSERT_EQ(queue.printing() ? 1 : 0, oracle.printing()) << "seed " << seed;
    for (const auto& [id, entry] : oracle.jobs) {
        const Job* job = queue.find(id);
        ASSERT_NE(job, nullptr);
        ASSERT_EQ(job->copies_done, entry.done) << "seed " << seed << " job " << id;
        ASSERT_EQ(job->state == JobState::printing, entry.printing) << "seed " << seed << " job " << id;
        ASSERT_LE(job->copies_done, job->copies);
        if (job->state == JobState::queued) {
            ASSERT_LT(job->copies_done, job->copies);
        }
    }
    const auto queued = queue.queued();
    for (std::size_t i = 1; i < queued.size(); ++i) {
        ASSERT_GE(queued[i - 1]->priority, queued[i]->priority) << "seed " << seed;
    }
}

void random_step(Jobs& queue, Oracle& oracle, std::mt19937_64& random) {
    const JobId id = 1 + static_cast<JobId>(random() % 12);
    switch (random() % 6) {
        case 0: {
            const int copies = 1 + static_cast<int>(random() % 3);
            const JobId made = add(queue, wanted("x", copies, static_cast<int>(random() % 3)));
            oracle.jobs[made] = {copies, 0, false, false, false};
            return;
        }
        case 1: {
            const auto change = queue.plan_remove(id);
            const bool expected = oracle.jobs.contains(id) && !oracle.jobs[id].printing;
            ASSERT_EQ(change.ok(), expected);
            if (change.ok()) queue.apply(*change), oracle.jobs.erase(id);
            return;
        }
        case 2: {
            const Job* next = queue.next();
            if (!next || queue.printing()) return;
            const JobId begun = next->id;
            queue.apply(*queue.plan_begin_copy(begun, 1));
            oracle.jobs[begun].printing = true;
            return;
        }
        case 3: {
            const Job* printing = queue.printing();
            if (!printing) return;
            const JobId ended = printing->id;
            const auto outcome = static_cast<CopyOutcome>(random() % 3);
            queue.apply(*queue.plan_end_copy(ended, outcome, "why", 2));
            oracle.jobs[ended].printing = false;
            oracle.jobs[ended].done += outcome == CopyOutcome::completed ? 1 : 0;
            return;
        }
        case 4: {
            const auto change = queue.plan_start(id);
            ASSERT_EQ(change.ok(), oracle.jobs.contains(id) && !oracle.jobs[id].printing);
            if (change.ok()) queue.apply(*change);
            return;
        }
        default: {
            const auto change = queue.plan_patch(id, move_before(1 + static_cast<JobId>(random() % 12)));
            if (change.ok()) queue.apply(*change);
            return;
        }
    }
}

TEST(Queue, RandomSequencesKeepItsInvariants) {
    for (std::uint64_t seed = 1; seed <= 200; ++seed) {
        std::mt19937_64 random{seed};
        Jobs queue;
        Oracle oracle;
        for (int step = 0; step < 200; ++step) {
            random_step(queue, oracle, random);
            check(queue, oracle, seed);
            if (HasFatalFailure()) return;
        }
    }
}

}  // namespace
}  // namespace qduino::spool::queue_test
