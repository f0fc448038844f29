// The list in pages, and how long jobs are kept, against a naive list of all jobs that is sorted
// and cut the slow way.
#include <gmock/gmock.h>

#include <algorithm>
#include <random>

#include "spool/name_search.h"
#include "tests/unit/spool/spool_fixture.h"

namespace qduino::spool::page_test {
namespace {

using ::testing::ElementsAre;

std::vector<JobId> ids_of(const JobPage& page) {
    std::vector<JobId> ids;
    for (const Job& job : page.jobs) ids.push_back(job.id);
    return ids;
}

TEST(NameSearch, KnowsNoCase) {
    EXPECT_TRUE(name_holds("Benchy.GCODE", folded("bENCHY.g")));
    EXPECT_TRUE(name_holds("Prüfstück", folded("PRÜFSTÜCK")));
    EXPECT_TRUE(name_holds("ΑΒΓ Жук Ÿ Š Ĺ", folded("αβγ жУК ÿ š ĺ")));
    EXPECT_TRUE(name_holds("anything", folded("")));
    EXPECT_FALSE(name_holds("benchy", folded("benchy2")));
    EXPECT_TRUE(name_holds("100% _x", folded("% _"))) << "no wildcards";
    EXPECT_EQ(folded("\xC3"), "\xC3") << "what is no UTF-8 stays";
}

/// All jobs as a person would write them down, in the order of the list.
class ListOracle {
  public:
    struct Entry {
        JobId id;
        std::string name;
        JobState state;
        bool hold;
    };
    std::vector<Entry> waiting;  // in the order they came: all have the same priority
    std::vector<Entry> ended;    // newest first

    /// web/ui/mock/jobs.mjs, pageOf(), word for word.
    [[nodiscard]] JobPage page(const JobQuery& query) const {
        std::vector<Entry> all = waiting;
        all.insert(all.end(), ended.begin(), ended.end());
        const bool plain = query.is_first_page();
        std::size_t from = 0;
        for (std::size_t i = 0; query.before && i < all.size(); ++i) {
            if (all[i].id == *query.before) from = i + 1;
        }
        std::vector<JobId> head, rest;
        for (std::size_t i = from; i < all.size(); ++i) {
            const bool is_waiting = all[i].state == JobState::queued;
            if (!wanted(all[i], query)) continue;
            if (plain && is_waiting) {
                if (head.size() < JobQuery::kFirstWaiting) head.push_back(all[i].id);
            } else {
                rest.push_back(all[i].id);
            }
        }
        JobPage page;
        if (rest.size() > query.limit) {
            rest.resize(query.limit);
            page.next_before = rest.back();
        }
        head.insert(head.end(), rest.begin(), rest.end());
        for (const JobId id : head) page.jobs.emplace_back().id = id;
        return page;
    }

  private:
    static bool wanted(const Entry& entry, const JobQuery& query) {
        const bool state = entry.state == JobState::queued      ? (entry.hold ? query.held : query.waiting)
                           : entry.state == JobState::done      ? query.done
                           : entry.state == JobState::cancelled ? query.cancelled
                                                                : query.failed;
        return state && name_holds(entry.name, folded(query.text));
    }
};

class PageTest : public SpoolTest {
  protected:
    /// A job that has ended, without printing it: straight into the journal.
    void put_ended(JobId id, const std::string& name, JobState state) {
        Job job;
        job.id = id;
        job.name = name;
        job.sha256 = sha256_of(name);
        job.state = state;
        job.order = ++ended_order_;
        job.ended_s = 1000 + ended_order_ % 3;  // many in the same second
        job.facts_json = "{}";
        Commit commit;
        commit.jobs.put.push_back(job);
        ASSERT_TRUE(spool_->store().commit(commit).ok());
        oracle_.ended.insert(oracle_.ended.begin(), {id, name, state, false});
    }
    void put_waiting(const std::string& name, bool hold) {
        const JobId id = *add(name, {name, 1, 0, hold});
        oracle_.waiting.push_back({id, name, JobState::queued, hold});
    }
    /// Random jobs: numbers of ended and waiting ones mixed.
    void fill(std::mt19937_64& random, int waiting, int ended) {
        open_spool();
        const std::vector<std::string> names{"Bracket", "bench", "gear", "Hülle", "HÜLSE"};
        const auto name = [&](int i) {
            return names[random() % names.size()] + std::to_string(i) + ".gcode";
        };
        for (int i = 0; i < ended; ++i) {
            const JobState states[] = {JobState::done, JobState::cancelled, JobState::failed};
            put_ended(1000 + static_cast<JobId>((i * 37) % 1009), name(i), states[random() % 3]);
        }
        for (int i = 0; i < waiting; ++i) put_waiting(name(i), random() % 3 == 0);
    }
    JobQuery random_query(std::mt19937_64& random) const {
        JobQuery query;
        query.limit = 1 + random() % 30;
        if (random() % 3 == 0)
            query.text = std::vector<std::string>{"b", "HÜL", "gear1", "none", "."}[random() % 5];
        if (random() % 3 == 0) {
            for (bool* state :
                 {&query.waiting, &query.held, &query.printing, &query.done, &query.cancelled, &query.failed})
                *state = random() % 2 == 0;
        }
        const std::size_t known = oracle_.waiting.size() + oracle_.ended.size();
        if (random() % 2 == 0) {
            const std::size_t at = random() % (known + 3);
            query.before = at < oracle_.waiting.size() ? oracle_.waiting[at].id
                           : at < known                ? oracle_.ended[at - oracle_.waiting.size()].id
                                                       : 999'999;
        }
        return query;
    }
    ListOracle oracle_;
    std::int64_t ended_order_ = 0;
};

TEST_F(PageTest, AnyPageIsWhatTheNaiveListGives) {
    std::mt19937_64 random{11};
    fill(random, 120, 200);
    for (int i = 0; i < 1500; ++i) {
        const JobQuery query = random_query(random);
        const auto page = spool_->page(query);
        ASSERT_TRUE(page.ok());
        const JobPage expected = oracle_.page(query);
        ASSERT_EQ(ids_of(*page), ids_of(expected)) << "query " << i;
        ASSERT_EQ(page->next_before, expected.next_before) << "query " << i;
    }
}

TEST_F(PageTest, PagesJoinToTheWholeListWithoutGapsOrRepeats) {
    std::mt19937_64 random{12};
    fill(random, 7, 90);
    for (const std::size_t limit : {1, 7, 50}) {
        JobQuery query;
        query.limit = limit;
        std::vector<JobId> all;
        do {
            const auto page = spool_->page(query);
            ASSERT_TRUE(page.ok());
            for (const JobId id : ids_of(*page)) all.push_back(id);
            query.before = page->next_before;
        } while (query.before);
        std::vector<JobId> expected;
        for (const auto& entry : oracle_.waiting) expected.push_back(entry.id);
        for (const auto& entry : oracle_.ended) expected.push_back(entry.id);
        EXPECT_EQ(all, expected) << "limit " << limit;
    }
}

TEST_F(PageTest, EndedJobsAreNotInMemoryAndTheFirstPageIsBounded) {
    std::mt19937_64 random{13};
    fill(random, 150, 900);
    open_spool();
    EXPECT_EQ(spool_->queue().size(), 150u) << "only what waits";
    EXPECT_EQ(spool_->page({})->jobs.size(), JobQuery::kFirstWaiting + 50);
    EXPECT_EQ(spool_->counts().total(), 1050);
    EXPECT_EQ(spool_->counts().ended(), 900);
}

TEST_F(PageTest, OfTooManyEndedJobsTheOldestGoWithTheirFiles) {
    options_.retention.jobs_max = 20;
    std::mt19937_64 random{14};
    fill(random, 30, 100);
    const JobId kept_file_of = *add("shared bytes", {"shared.gcode", 1, 0, true});
    const auto shared = spool_->find(kept_file_of)->sha256;
    run(30);
    EXPECT_EQ(spool_->counts().ended(), 20);
    EXPECT_EQ(spool_->counts().queued, 31) << "what waits is never deleted";
    JobQuery ended;
    ended.waiting = ended.held = false;
    oracle_.ended.resize(20);
    std::vector<JobId> expected;
    for (const auto& entry : oracle_.ended) expected.push_back(entry.id);
    EXPECT_EQ(ids_of(*spool_->page(ended)), expected);
    EXPECT_TRUE(std::filesystem::exists(blobs().path(shared, BlobPart::gcode)));
}

TEST_F(PageTest, OldEndedJobsGoAfterTheirDays) {
    options_.retention.days_max = 2;
    open_spool();
    for (JobId id = 1; id <= 40; ++id) put_ended(id, "a", JobState::done);
    run(5);
    EXPECT_EQ(spool_->counts().ended(), 40);
    now_ += std::chrono::hours{49};
    run(5);
    EXPECT_EQ(spool_->counts().ended(), 0);
}

TEST_F(PageTest, AClockThatIsWrongDeletesNothing) {
    options_.retention.days_max = 2;
    open_spool();
    for (JobId id = 1; id <= 10; ++id) put_ended(id, "a", JobState::done);
    run(5);
    const auto tick_for_an_hour = [&](UnixSeconds calendar_s) {
        for (int minute = 0; minute < 60; ++minute, now_ += 60s) spool_->tick(now_, calendar_s + 60 * minute);
    };
    constexpr UnixSeconds kYears_s = UnixSeconds{70} * 366 * 86400;
    for (const UnixSeconds jump_s : {kYears_s, UnixSeconds{0}, 2 * kYears_s, -kYears_s}) {
        tick_for_an_hour(1000 + to_ns(now_) / 1'000'000'000 + jump_s);
        EXPECT_EQ(spool_->counts().ended(), 10) << "after a jump by " << jump_s << " s";
    }
    open_spool();  // with a clock that is wrong from the start
    tick_for_an_hour(kYears_s);
    EXPECT_EQ(spool_->counts().ended(), 10);
    options_.calendar_from_s = 2 * kYears_s;  // and one that starts before this was written
    open_spool();
    now_ += std::chrono::hours{49};
    tick_for_an_hour(1000 + to_ns(now_) / 1'000'000'000);
    EXPECT_EQ(spool_->counts().ended(), 10);
}

class StoreLimitTest : public SpoolTest {
  protected:
    void SetUp() override {
        SpoolTest::SetUp();
        options_.retention.bytes_max = 100'000;
        start_sketch();
        open_spool();
    }
    bool is_there(JobId id) { return spool_->find(id).has_value(); }
};

TEST_F(StoreLimitTest, TheOldestEndedJobsMakeRoom) {
    std::vector<JobId> printed;
    for (unsigned seed = 0; seed < 3; ++seed) {
        printed.push_back(*add(content_of(30'000, seed * 10'000)));
        run(20);
        ASSERT_EQ(state(printed.back()), JobState::done);
    }
    EXPECT_EQ(spool_->store().stored_bytes(), 90'000u);
    const JobId next = *add(content_of(35'000, 70'000), {"next.gcode", 1, 0, true});
    EXPECT_FALSE(is_there(printed[0]));
    EXPECT_TRUE(is_there(printed[1]) && is_there(printed[2])) << "no more than needed";
    EXPECT_TRUE(is_there(next));
    EXPECT_EQ(spool_->store().stored_bytes(), 95'000u);
    open_spool();
    EXPECT_EQ(spool_->store().stored_bytes(), 95'000u) << "counted anew";
}

TEST_F(StoreLimitTest, WhatWaitsIsNeverDeletedAndNothingGoesInVain) {
    const JobId printed = *add(content_of(30'000, 1));
    run(20);
    const JobId waits = *add(content_of(60'000, 20'000), {"waits.gcode", 1, 0, true});
    const Result<JobId> refused = add(content_of(50'000, 40'000));
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::unavailable);
    EXPECT_NE(refused.error().message.view().find("--store-limit-mib"), std::string_view::npos);
    EXPECT_TRUE(is_there(printed) && is_there(waits));
    EXPECT_TRUE(add(content_of(60'000, 20'000), {"again.gcode", 1, 0, true}).ok())
        << "the same bytes take no room";
    EXPECT_TRUE(add(content_of(40'000, 50'000)).ok());
    EXPECT_FALSE(is_there(printed));
}

}  // namespace
}  // namespace qduino::spool::page_test
