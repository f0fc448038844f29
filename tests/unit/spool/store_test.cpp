// The journal: everything committed is there, whole, when it is opened again.
#include "spool/store.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>

namespace qduino::spool::store_test {
namespace {

class StoreTest : public ::testing::Test {
  protected:
    void SetUp() override {
        std::string pattern = (std::filesystem::temp_directory_path() / "store-XXXXXX").string();
        ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
        folder_ = pattern;
        reopen();
    }
    void TearDown() override {
        store_.reset();
        std::filesystem::remove_all(folder_);
    }
    void reopen() {
        store_.reset();
        auto opened = Store::open(folder_ / "journal.sqlite");
        ASSERT_TRUE(opened.ok()) << opened.error().message.view();
        store_ = std::move(*opened);
    }
    StoredState load() { return *store_->load(); }

    std::filesystem::path folder_;
    std::unique_ptr<Store> store_;
};

Job full_job() {
    Job job;
    job.id = 3;
    job.name = "½ \"quoted\"; DROP TABLE jobs.gcode";
    job.size = (std::uint64_t{1} << 40) + 1;
    job.sha256 = std::string(64, 'a');
    job.state = JobState::failed;
    job.hold = true;
    job.copies = 4;
    job.copies_done = 2;
    job.priority = -3;
    job.order = 17;
    job.created_s = 100;
    job.started_s = 200;
    job.ended_s = 300;
    job.error = "why";
    job.facts_json = R"({"layers":5})";
    job.estimated_s = 12.5;
    job.has_layers = true;
    job.has_thumbnail = true;
    job.stopped_line = 812;
    job.stopped_layer = 14;
    job.stopped_byte = 30'017;
    job.printed_s = 1234;
    job.stored_bytes = 5000;
    return job;
}

/// The largest file that this process can write, for a while.
class Room {
  public:
    explicit Room(std::uintmax_t bytes) {
        std::signal(SIGXFSZ, SIG_IGN);  // write(2) then fails
        ::getrlimit(RLIMIT_FSIZE, &before_);
        const rlimit little{bytes, before_.rlim_max};
        ::setrlimit(RLIMIT_FSIZE, &little);
    }
    ~Room() { more(); }
    Room(const Room&) = delete;
    Room& operator=(const Room&) = delete;
    void more() const { ::setrlimit(RLIMIT_FSIZE, &before_); }

  private:
    rlimit before_{};
};

/// In the log's file a frame more or less has room; each failure is one inside of a transaction.
TEST_F(StoreTest, IsAskedToMakeRoomWhereverACommitFailsForWantOfIt) {
    int asked = 0;
    for (std::uintmax_t bytes = 0; bytes < 3 * 4120; bytes += 500) {
        Commit commit;
        commit.jobs.put.push_back(full_job());
        commit.jobs.put.back().id = 1 + static_cast<JobId>(bytes);
        const std::uintmax_t log = std::filesystem::file_size(folder_ / "journal.sqlite-wal");
        const Room room{log + bytes % 4120};
        bool was_asked = false;
        store_->when_full([&] {
            was_asked = true;
            room.more();
            return true;
        });
        const auto done = store_->commit(commit);
        EXPECT_TRUE(done.ok()) << bytes << ": " << done.error().message.view();
        asked += was_asked ? 1 : 0;
    }
    EXPECT_GT(asked, 10);
}

TEST_F(StoreTest, AJobComesBackFieldByField) {
    Commit commit;
    commit.jobs.put.push_back(full_job());
    ASSERT_TRUE(store_->commit(commit).ok());
    reopen();
    const StoredState state = load();
    EXPECT_TRUE(state.jobs.empty()) << "it has ended";
    EXPECT_EQ(state.last_ended, 17);
    const Job read = store_->find(3).value();
    const Job written = full_job();
    EXPECT_EQ(read.name, written.name);
    EXPECT_EQ(read.size, written.size);
    EXPECT_EQ(read.sha256, written.sha256);
    EXPECT_EQ(read.state, written.state);
    EXPECT_EQ(read.hold, written.hold);
    EXPECT_EQ(read.copies, written.copies);
    EXPECT_EQ(read.copies_done, written.copies_done);
    EXPECT_EQ(read.priority, written.priority);
    EXPECT_EQ(read.order, written.order);
    EXPECT_EQ(read.created_s, written.created_s);
    EXPECT_EQ(read.started_s, written.started_s);
    EXPECT_EQ(read.ended_s, written.ended_s);
    EXPECT_EQ(read.error, written.error);
    EXPECT_EQ(read.facts_json, written.facts_json);
    EXPECT_EQ(read.estimated_s, written.estimated_s);
    EXPECT_EQ(read.has_layers, written.has_layers);
    EXPECT_EQ(read.has_thumbnail, written.has_thumbnail);
    EXPECT_EQ(read.stopped_line, written.stopped_line);
    EXPECT_EQ(read.stopped_layer, written.stopped_layer);
    EXPECT_EQ(read.stopped_byte, written.stopped_byte);
    EXPECT_EQ(read.printed_s, written.printed_s);
    EXPECT_EQ(read.stored_bytes, written.stored_bytes);
    EXPECT_EQ(store_->counts().failed, 1);
    EXPECT_EQ(store_->stored_bytes(), written.stored_bytes);
    EXPECT_EQ(state.next_job_id, 4);
}

TEST_F(StoreTest, NumbersOfErasedJobsAreNotGivenAgain) {
    Commit commit;
    commit.jobs.put.push_back(full_job());
    ASSERT_TRUE(store_->commit(commit).ok());
    Commit erase;
    erase.jobs.erase.push_back(3);
    ASSERT_TRUE(store_->commit(erase).ok());
    reopen();
    EXPECT_EQ(store_->find(3).error().code, ErrorCode::not_found);
    EXPECT_EQ(store_->counts().total(), 0);
    EXPECT_EQ(store_->stored_bytes(), 0u);
    EXPECT_EQ(load().next_job_id, 4);
}

TEST_F(StoreTest, ARunIsActiveUntilItsEndIsCommitted) {
    Commit begin;
    begin.run_begun = spool::Run{9, 3, ~std::uint64_t{0}, 1000, false, true};
    ASSERT_TRUE(store_->commit(begin).ok());
    reopen();
    ASSERT_TRUE(load().active_run.has_value());
    EXPECT_EQ(load().active_run->session, ~std::uint64_t{0});
    EXPECT_EQ(load().last_run_id, 9u);
    Commit cancel;
    cancel.run_changed = load().active_run;
    cancel.run_changed->cancel_asked = true;
    ASSERT_TRUE(store_->commit(cancel).ok());
    EXPECT_TRUE(load().active_run->cancel_asked);

    Commit end;
    end.run_ended = Commit::RunEnd{9, "completed", 5};
    ASSERT_TRUE(store_->commit(end).ok());
    reopen();
    EXPECT_FALSE(load().active_run.has_value());
    ASSERT_TRUE(load().awaited_report.has_value()) << "the inspector still owes its report";
    Commit report;
    report.report.emplace(9, "{}");
    ASSERT_TRUE(store_->commit(report).ok());
    EXPECT_FALSE(load().awaited_report.has_value());
    EXPECT_EQ(*store_->report_of(3), "{}");
    EXPECT_EQ(store_->report_of(4).error().code, ErrorCode::not_found);
}

TEST_F(StoreTest, TheSchemaItselfForbidsTwoRunsAndTwoPrintingJobs) {
    Commit begin;
    begin.run_begun = spool::Run{1, 3, 1, 1, false, false};
    ASSERT_TRUE(store_->commit(begin).ok());
    begin.run_begun = spool::Run{2, 3, 1, 1, false, false};
    EXPECT_FALSE(store_->commit(begin).ok());
    Commit jobs;
    for (const JobId id : {1, 2}) {
        Job job = full_job();
        job.id = id;
        job.state = JobState::printing;
        jobs.jobs.put.push_back(job);
    }
    EXPECT_FALSE(store_->commit(jobs).ok());
    EXPECT_TRUE(load().jobs.empty()) << "half of a transaction is nothing";
}

TEST_F(StoreTest, SessionsAndTheGateAreKept) {
    ASSERT_TRUE(store_->put_session({"aa", 10}).ok());
    ASSERT_TRUE(store_->put_session({"bb", 20}).ok());
    Commit commit;
    commit.gate = QueueGate{"a job failed", true};
    ASSERT_TRUE(store_->commit(commit).ok());
    reopen();
    ASSERT_TRUE(store_->keep_sessions(1).ok());
    EXPECT_EQ(store_->sessions()->size(), 1u);
    EXPECT_EQ(load().gate.hold_reason, "a job failed");
    EXPECT_TRUE(load().gate.bed_occupied);
    ASSERT_TRUE(store_->erase_session("bb").ok());
    EXPECT_TRUE(store_->sessions()->empty());
}

TEST_F(StoreTest, AFileThatIsNoJournalIsRefusedWithAReason) {
    std::ofstream{folder_ / "other.sqlite"} << std::string(5000, 'x');
    const auto opened = Store::open(folder_ / "other.sqlite");
    ASSERT_FALSE(opened.ok());
    EXPECT_EQ(opened.error().code, ErrorCode::corrupt);
}

}  // namespace
}  // namespace qduino::spool::store_test
