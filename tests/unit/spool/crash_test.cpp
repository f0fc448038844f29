// kill -9 at random moments: a child uploads, reorders, deletes and prints; everything that it had
// acknowledged is there afterwards.
//
// The child tells the parent of each finished call through a pipe (the acknowledgement). The parent
// kills it at a random moment, opens the same folder, and compares. The sketch lives in memory that
// outlives the child.
#include <fcntl.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/wait.h>

#include <chrono>
#include <new>
#include <random>
#include <set>
#include <thread>

#include "tests/unit/spool/spool_fixture.h"

namespace qduino::spool::crash_test {
namespace {

struct Acknowledged {
    enum class What : std::uint8_t { added, removed } what;
    JobId id;
    std::uint32_t seed;
    std::uint32_t size;
};

class CrashTest : public SpoolTest {
  protected:
    void SetUp() override {
        SpoolTest::SetUp();
        void* shared = ::mmap(nullptr, sizeof(printer::link::LinkLayout), PROT_READ | PROT_WRITE,
                              MAP_SHARED | MAP_ANONYMOUS, -1, 0);
        ASSERT_NE(shared, MAP_FAILED);
        shared_ = new (shared) printer::link::LinkLayout;
        shared_->session = 1;
    }
    void TearDown() override {
        SpoolTest::TearDown();
        ::munmap(static_cast<void*>(shared_), sizeof(printer::link::LinkLayout));
    }

    void open_on_shared() {
        spool_.reset();
        link_ = std::make_unique<TestLink>();
        link_->set(shared_);
        auto opened = opened_spool(nullptr);
        if (!opened.ok()) std::abort();
        spool_ = std::move(*opened);
    }

    /// The child: works until it is killed. Jobs are small, so that many boundaries are crossed.
    [[noreturn]] void work(int acknowledge, std::uint64_t seed) {
        std::mt19937_64 random{seed};
        open_on_shared();
        for (std::int64_t tick = 1;; ++tick) {
            spool_->tick(instant_from_ns(tick * 20'000'000), 1);
            if (random() % 3 == 0) {
                const auto content_seed = static_cast<std::uint32_t>(random());
                const auto size = static_cast<std::uint32_t>(1 + random() % 60'000);
                const Result<JobId> id = add(content_of(size, content_seed));
                if (!id.ok()) ::_exit(2);
                send(acknowledge, {Acknowledged::What::added, *id, content_seed, size});
            }
            if (random() % 10 == 0 && spool_->counts().total() > 0) {
                const JobId id = spool_->page({})->jobs.back().id;
                if (spool_->remove(id).ok()) send(acknowledge, {Acknowledged::What::removed, id, 0, 0});
            }
        }
    }
    static void send(int pipe, const Acknowledged& record) {
        if (::write(pipe, &record, sizeof record) != static_cast<ssize_t>(sizeof record)) ::_exit(3);
    }

    void kill_at_random_moment(std::uint64_t seed) {
        int pipe[2];
        ASSERT_EQ(::pipe2(pipe, O_CLOEXEC), 0);
        ASSERT_GT(::fcntl(pipe[1], F_SETPIPE_SZ, 1 << 20), 0);
        const pid_t child = ::fork();
        ASSERT_GE(child, 0);
        if (child == 0) work(pipe[1], seed);
        std::mt19937_64 random{seed};
        const auto until =
            std::chrono::steady_clock::now() + std::chrono::microseconds{5000 + random() % 60'000};
        while (std::chrono::steady_clock::now() < until) {
            shared_sketch_->step(random() % 40'000);
            std::this_thread::sleep_for(std::chrono::microseconds{random() % 500});
        }
        ::kill(child, SIGKILL);
        int status = 0;
        ::waitpid(child, &status, 0);
        ASSERT_TRUE(WIFSIGNALED(status)) << "seed " << seed;
        ::close(pipe[1]);
        Acknowledged record;
        while (::read(pipe[0], &record, sizeof record) == static_cast<ssize_t>(sizeof record)) {
            if (record.what == Acknowledged::What::added) {
                contents_[record.id] = content_of(record.size, record.seed);
            } else {
                removed_.insert(record.id);
            }
        }
        ::close(pipe[0]);
    }

    /// Acknowledged jobs are there with their bytes; at most the one call that was under way is
    /// unknown.
    void expect_acknowledged(std::uint64_t seed) {
        std::size_t missing = 0;
        for (const auto& [id, content] : contents_) {
            const std::optional<Job> job = spool_->find(id);
            if (removed_.contains(id)) {
                EXPECT_FALSE(job.has_value()) << "seed " << seed << " job " << id;
                continue;
            }
            if (!job) {
                ++missing;  // its removal was durable, but the child died before it could say so
                removed_.insert(id);
                continue;
            }
            EXPECT_EQ(job->sha256, sha256_of(content)) << "seed " << seed << " job " << id;
            EXPECT_EQ(std::filesystem::file_size(blobs().path(job->sha256, BlobPart::gcode)), content.size());
        }
        EXPECT_LE(missing, 1u) << "seed " << seed;
    }

    printer::link::LinkLayout* shared_ = nullptr;
    std::unique_ptr<tests::FakeSketch> shared_sketch_;
    std::map<JobId, std::string> contents_;
    std::set<JobId> removed_;
    std::size_t unacknowledged_prints_ = 0;
};

TEST_F(CrashTest, WhatWasAcknowledgedSurvivesAndPrintsOnce) {
    Printed printed;
    shared_sketch_ = std::make_unique<tests::FakeSketch>(*shared_, printed.log());
    // On a busy machine a child may be killed before it has printed anything: then there are more
    // of them.
    std::uint64_t kills = 0;
    for (std::uint64_t seed = 1; seed <= 40 || (printed.bytes.size() <= 40 && seed <= 400); ++seed, ++kills) {
        kill_at_random_moment(seed);
        open_on_shared();
        expect_acknowledged(seed);
        spool_.reset();
        ASSERT_FALSE(HasFailure()) << "seed " << seed;
    }
    // What is left of the queue prints, and every run that completed had the bytes of one upload.
    open_on_shared();
    std::int64_t tick = 1'000'000;
    while ((spool_->queue().next() || spool_->active_run()) && tick < 1'100'000) {
        spool_->tick(instant_from_ns(++tick * 20'000'000), 1);
        shared_sketch_->step(1 << 20);
    }
    EXPECT_EQ(spool_->queue().next(), nullptr);
    std::multiset<std::string> uploaded;
    for (const auto& [id, content] : contents_) uploaded.insert(content);
    for (const auto& [run, bytes] : printed.bytes) {
        ASSERT_EQ(printed.outcomes.at(run), printer::link::JobOutcome::completed);
        const auto found = uploaded.find(bytes);
        if (found == uploaded.end()) {
            ++unacknowledged_prints_;
        } else {
            uploaded.erase(found);
        }
    }
    // A job may be durable and print although its uploader was killed before the acknowledgement:
    // one a kill at most.
    EXPECT_LE(unacknowledged_prints_, kills);
    EXPECT_GT(printed.bytes.size(), 40u) << "the test printed too little to prove anything";
    for (const auto& [id, content] : contents_) {
        const std::optional<Job> job = spool_->find(id);
        if (!removed_.contains(id)) {
            ASSERT_TRUE(job.has_value());
            EXPECT_EQ(job->state, JobState::done) << id;
            EXPECT_EQ(uploaded.count(content), 0u) << "job " << id << " was not printed";
        }
    }
}

}  // namespace
}  // namespace qduino::spool::crash_test
