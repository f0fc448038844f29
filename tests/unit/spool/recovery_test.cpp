// Damage to the journal, of every kind and at every moment: no acknowledged upload is lost, and
// nothing prints twice.
#include <gmock/gmock.h>
#include <signal.h>
#include <sys/wait.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <random>
#include <thread>

#include <SQLiteCpp/SQLiteCpp.h>

#include "spool/disk/journal.h"
#include "spool/disk/recovery.h"
#include "tests/unit/spool/spool_fixture.h"

namespace qduino::spool::recovery_test {
namespace {

using ::testing::HasSubstr;

/// Facts that show that it was asked; refuses what begins with "no".
class MarkingReading final : public FileReading {
  public:
    explicit MarkingReading(ByteSink& layers) : layers_(layers) {}
    std::optional<Analysis> feed(std::span<const char> bytes) override {
        text_.append(bytes.data(), bytes.size());
        return std::nullopt;
    }
    Result<Analysis> finish() override {
        Analysis analysis;
        if (text_.starts_with("no")) analysis.verdict = Analysis::Verdict::violation;
        analysis.message = "it does not fit";
        analysis.facts_json = R"({"layers":7})";
        analysis.layers_json = "[7]";
        analysis.thumbnail = "png";
        QDUINO_TRY(layers_.write(std::string_view{"packed"}));
        return analysis;
    }

  private:
    ByteSink& layers_;
    std::string text_;
};

class MarkingAnalyzer final : public Analyzer {
  public:
    std::unique_ptr<FileReading> begin(ByteSink& layers) override {
        ++asked;
        return std::make_unique<MarkingReading>(layers);
    }
    int asked = 0;
};

class RecoveryTest : public SpoolTest {
  protected:
    void SetUp() override {
        SpoolTest::SetUp();
        disk_.analyzer = &analyzer_;
        disk_.opened_s = 1'800'000'000;
    }

    void upload(const std::string& content, NewJob wanted = {}) {
        const Result<JobId> id = add(content, std::move(wanted));
        ASSERT_TRUE(id.ok());
        acknowledged_[*id] = sha256_of(content);
    }
    /// Jobs of every kind: printed, waiting, held, two of the same bytes.
    void fill() {
        start_sketch();
        open_spool();
        upload("G28\n;printed");
        run(20);
        ASSERT_EQ(state(1), JobState::done);
        sketch_.reset();
        run(200);  // it no longer answers: nothing begins
        upload("G28\n;waiting", {"waiting é.gcode", 3, 0, false});
        upload("G28\n;held", {"held.gcode", 1, 5, true});
        upload("G28\n;held", {"again.gcode", 1, 0, false});
        for (unsigned i = 0; i < 12; ++i)
            upload(content_of(500, 1000 * i), {"part " + std::to_string(i) + ".gcode", 1, 0, false});
    }
    /// A clean stop, which leaves a copy that knows everything.
    void stop() { spool_.reset(); }
    /// As kill -9 leaves it: the copy is of an earlier moment, and the journal's log is still
    /// there.
    void kill_with_older_copy() {
        // The spool's own thread made its first copy in fill(). If that were named only now, it
        // would replace this one, which knows more.
        for (int looks = 0; !std::filesystem::exists(copy()) && looks < 30'000; ++looks)
            std::this_thread::sleep_for(std::chrono::milliseconds{1});
        ASSERT_TRUE(copy_journal(state_folder()).ok());
        upload("G28\n;after the copy", {"late.gcode", 1, 0, false});
        upload("G28\n;held", {"late again.gcode", 1, 0, false});
        const auto frozen = folder_ / "frozen";
        copy_at_one_moment(state_folder(), frozen);
        spool_.reset();
        std::filesystem::remove_all(state_folder());
        std::filesystem::rename(frozen, state_folder());
    }
    /// Copies a folder in which the spool's own thread may still rename or remove a temporary file.
    /// A file that is gone when its turn comes belongs to an earlier moment than the rest: the copy
    /// is made anew then.
    static void copy_at_one_moment(const std::filesystem::path& from, const std::filesystem::path& to) {
        std::error_code gone;
        for (int attempt = 0; attempt < 1000; ++attempt) {
            std::filesystem::remove_all(to);
            std::filesystem::copy(from, to, std::filesystem::copy_options::recursive, gone);
            if (gone != std::errc::no_such_file_or_directory) break;
        }
        ASSERT_FALSE(gone) << from << ": " << gone.message();
    }
    std::filesystem::path state_folder() const { return disk_.folder; }
    std::filesystem::path journal() const { return state_folder() / "journal.sqlite"; }
    std::filesystem::path copy() const { return state_folder() / "journal.copy.sqlite"; }
    void remove_journal() {
        for (const char* ending : {"", "-wal", "-shm"}) std::filesystem::remove(journal().string() + ending);
    }
    /// Folds the log into the journal, so that it is the journal itself that is damaged.
    void fold() {
        SQLite::Database open{journal().string(), SQLite::OPEN_READWRITE};
        open.exec("PRAGMA wal_checkpoint(TRUNCATE)");
    }
    void overwrite(std::uint64_t offset, const std::string& bytes) {
        std::fstream file{journal(), std::ios::in | std::ios::out | std::ios::binary};
        file.seekp(static_cast<std::streamoff>(offset));
        file << bytes;
    }
    Result<void> try_open() {
        spool_.reset();
        link_ = std::make_unique<TestLink>();
        link_->set(layout_.get());
        auto opened = opened_spool(nullptr);
        if (!opened.ok()) return opened.error();
        spool_ = std::move(*opened);
        return {};
    }
    Result<Recovered> recover() {
        spool_.reset();
        return recover_folder(state_folder(), analyzer_, 1'800'000'001,
                              [this](const std::string& line) { said_.push_back(line); });
    }
    /// Every upload that was acknowledged is a job with its bytes.
    void expect_nothing_lost(const std::string& what) {
        run(60);  // the sweep has been everywhere
        for (const auto& [id, sha256] : acknowledged_) {
            const std::optional<Job> job = spool_->find(id);
            ASSERT_TRUE(job.has_value()) << what << ": job " << id;
            EXPECT_EQ(job->sha256, sha256) << what << ": job " << id;
            std::ifstream file{blobs().path(sha256, BlobPart::gcode), std::ios::binary};
            const std::string bytes{std::istreambuf_iterator<char>{file}, {}};
            EXPECT_EQ(sha256_of(bytes), sha256) << what << ": job " << id;
        }
    }
    void expect_all_held(const std::string& what) {
        EXPECT_FALSE(spool_->gate().hold_reason.empty()) << what;
        EXPECT_EQ(spool_->queue().next(), nullptr) << what << ": something would print by itself";
    }
    std::size_t set_aside_journals() const {
        std::size_t count = 0;
        for (const auto& entry : std::filesystem::directory_iterator{state_folder()})
            count += entry.path().filename().string().starts_with("journal.damaged-2027") &&
                             entry.path().extension() == ".sqlite"
                         ? 1
                         : 0;
        return count;
    }

    MarkingAnalyzer analyzer_;
    std::map<JobId, std::string> acknowledged_;
    std::vector<std::string> said_;
};

// ---- a journal that is not there ----------------------------------------------------------------

TEST_F(RecoveryTest, AMissingJournalSetsTheFilesAsideAndSaysSo) {
    fill();
    stop();
    remove_journal();
    std::filesystem::remove(copy());
    ASSERT_TRUE(try_open().ok()) << "the service starts";
    EXPECT_THAT(spool_->gate().hold_reason, HasSubstr("printd --recover"));
    EXPECT_THAT(spool_->gate().hold_reason, HasSubstr("15 stored files"));
    EXPECT_THAT(spool_->take_log(), ::testing::Contains(HasSubstr("printd --recover")));
    run(60);
    ASSERT_TRUE(try_open().ok());
    run(60);
    EXPECT_EQ(blobs().all_set_aside().size(), 15u) << "and they stay";
    EXPECT_THAT(spool_->gate().hold_reason, HasSubstr("printd --recover")) << "a restart changes nothing";

    upload("G28\n;new", {"new.gcode", 1, 0, true});  // takes the number of a lost one
    acknowledged_.clear();
    const Result<Recovered> done = recover();
    ASSERT_TRUE(done.ok()) << done.error().message.view();
    EXPECT_EQ(done->jobs, 16u) << "two uploads had the same bytes";
    ASSERT_TRUE(try_open().ok());
    expect_all_held("missing");
    EXPECT_TRUE(blobs().all_set_aside().empty());
    const std::optional<Job> job = spool_->find(2);
    ASSERT_TRUE(job.has_value());
    EXPECT_EQ(job->name, "waiting é.gcode");
    EXPECT_TRUE(job->hold);
    EXPECT_EQ(job->facts_json, R"({"layers":7})") << "analyzed anew";
    EXPECT_TRUE(job->has_layers && job->has_thumbnail);
    EXPECT_GE(job->created_s, 1000);
    EXPECT_TRUE(std::filesystem::exists(blobs().path(job->sha256, BlobPart::layers)));
    EXPECT_EQ(spool_->find(1)->name, "new.gcode") << "who has a number keeps it";
    EXPECT_EQ(spool_->counts().total(), 17);
    EXPECT_THAT(said_, ::testing::Contains(HasSubstr(" of ")));
    const auto again = recover();
    ASSERT_TRUE(again.ok());
    EXPECT_EQ(again->jobs, 0u) << "once is enough";
}

TEST_F(RecoveryTest, AnEmptyJournalIsTakenForAMissingOne) {
    fill();
    stop();
    remove_journal();
    std::ofstream{journal()}.flush();
    std::filesystem::remove(copy());
    ASSERT_TRUE(try_open().ok());
    EXPECT_THAT(spool_->gate().hold_reason, HasSubstr("printd --recover"));
    run(60);
    EXPECT_EQ(blobs().all_set_aside().size(), 15u);
    ASSERT_TRUE(recover().ok());
    ASSERT_TRUE(try_open().ok());
    expect_nothing_lost("empty");
}

TEST_F(RecoveryTest, ABlobWithoutARowIsSweptWhenTheJournalIsItsOwn) {
    fill();
    stop();
    const auto blobs_folder = state_folder() / "blobs";
    std::ofstream{blobs_folder / (std::string(64, 'a') + ".gcode")} << "killed between rename and commit";
    std::ofstream{blobs_folder / (std::string(64, 'a') + ".job.new")} << "900\t1\tx.gcode\n";
    std::ofstream{blobs_folder / (std::string(64, 'b') + ".gcode")}
        << "deleted, and killed before its file was";
    std::ofstream{blobs_folder / (std::string(64, 'b') + ".job")} << "3\t1\tx.gcode\n";
    std::ofstream{blobs_folder / "cc.png.part"} << "x";
    ASSERT_TRUE(try_open().ok());
    expect_nothing_lost("swept");
    for (const auto& entry : std::filesystem::directory_iterator{blobs_folder}) {
        const std::string name = entry.path().filename().string();
        EXPECT_FALSE(name.starts_with("aaaa") || name.starts_with("bbbb") || name.ends_with(".part")) << name;
    }
    EXPECT_TRUE(blobs().all_set_aside().empty());
    EXPECT_TRUE(spool_->gate().hold_reason.empty());
}

TEST_F(RecoveryTest, AnOlderStateOfTheSameJournalSweepsNothingThatItNeverHad) {
    fill();
    copy_at_one_moment(state_folder(), folder_ / "backup");
    upload("G28\n;since then", {"since.gcode", 1, 0, false});
    stop();
    remove_journal();
    for (const char* ending : {"", "-wal", "-shm"}) {
        std::error_code absent;
        std::filesystem::copy(folder_ / "backup" / ("journal.sqlite" + std::string{ending}),
                              journal().string() + ending, absent);
    }
    ASSERT_TRUE(try_open().ok());
    run(60);
    EXPECT_EQ(blobs().all_set_aside().size(), 1u);
    EXPECT_THAT(spool_->gate().hold_reason, HasSubstr("printd --recover"));
    ASSERT_TRUE(recover().ok());
    ASSERT_TRUE(try_open().ok());
    expect_nothing_lost("older");
}

// ---- a journal that is damaged ------------------------------------------------------------------

class DamageTest : public RecoveryTest, public ::testing::WithParamInterface<int> {
  protected:
    /// What happens to the journal; its name.
    std::string damage(int kind) {
        const std::uint64_t size = std::filesystem::file_size(journal());
        const std::uint64_t page = 4096;
        const std::uint64_t truncated[] = {
            1, 15, 100, page - 1, page, size / 2 / page * page, size / 2 + 17, size - page, size - 1};
        if (kind < 9) {
            std::filesystem::resize_file(journal(), truncated[kind]);
            return "truncated to " + std::to_string(truncated[kind]) + " of " + std::to_string(size);
        }
        if (kind == 9) return overwrite(0, std::string(100, 'x')), "garbage head";
        if (kind == 10)
            return overwrite(size / page / 2 * page, std::string(page, '\x5A')),
                   "a page of garbage in the middle";
        std::ofstream{journal(), std::ios::trunc} << std::string(50'000, 'g');
        return "all garbage";
    }
};

TEST_P(DamageTest, IsRepairedFromTheCopyAndTheFilesThatItDoesNotKnow) {
    fill();
    kill_with_older_copy();
    fold();
    const std::string what = damage(GetParam());
    const Result<void> opened = try_open();
    ASSERT_TRUE(opened.ok()) << what << ": " << opened.error().message.view();
    EXPECT_EQ(set_aside_journals(), 1u) << what;
    expect_nothing_lost(what);
    expect_all_held(what);
    EXPECT_EQ(spool_->find(1)->state, JobState::done) << what << ": what the copy knows as printed stays so";
    EXPECT_EQ(spool_->find(2)->copies, 3) << what;
    EXPECT_EQ(spool_->find(17)->name, "late.gcode") << what << ": in no copy, made of its file";
    EXPECT_EQ(spool_->find(18)->name, "late again.gcode")
        << what << ": the same bytes as one that the copy knows";
    upload("G28\n;afterwards", {"after.gcode", 1, 0, true});
    EXPECT_GT(acknowledged_.rbegin()->first, 18) << "no number is used twice";
    ASSERT_TRUE(try_open().ok());
    expect_nothing_lost(what + ", started once more");
    EXPECT_EQ(set_aside_journals(), 1u) << what << ": repaired once";
}

TEST_P(DamageTest, WithoutACopyItIsRefusedWithTheWayOutWhichWorks) {
    if (GetParam() == 0) GTEST_SKIP() << "one byte is an empty journal";
    fill();
    stop();
    std::filesystem::remove(copy());
    fold();
    const std::string what = damage(GetParam());
    const std::uint64_t size = std::filesystem::file_size(journal());
    const Result<void> opened = try_open();
    ASSERT_FALSE(opened.ok()) << what;
    EXPECT_EQ(opened.error().code, ErrorCode::corrupt) << what;
    EXPECT_THAT(std::string{opened.error().message.view()}, HasSubstr("printd --recover")) << what;
    EXPECT_EQ(std::filesystem::file_size(journal()), size) << what << ": it is left as it is";
    EXPECT_EQ(set_aside_journals(), 0u);
    const Result<Recovered> done = recover();
    ASSERT_TRUE(done.ok()) << what << ": " << done.error().message.view();
    EXPECT_EQ(set_aside_journals(), 1u) << what;
    ASSERT_TRUE(try_open().ok()) << what;
    expect_nothing_lost(what);
    expect_all_held(what);
}

TEST_P(DamageTest, BesideItsLogItLosesNothingEither) {
    fill();
    kill_with_older_copy();
    const std::string what = damage(GetParam()) + ", with its log";
    ASSERT_TRUE(try_open().ok()) << what;
    expect_nothing_lost(what);
    if (set_aside_journals() > 0) expect_all_held(what);  // else everything was in the log
}

INSTANTIATE_TEST_SUITE_P(Kinds, DamageTest, ::testing::Range(0, 12));

TEST_F(RecoveryTest, AMissingJournalIsMadeAgainFromItsCopy) {
    fill();
    kill_with_older_copy();
    remove_journal();
    ASSERT_TRUE(try_open().ok());
    expect_nothing_lost("missing, with a copy");
    expect_all_held("missing, with a copy");
}

TEST_F(RecoveryTest, ADamagedCopyIsNotTrusted) {
    fill();
    stop();
    fold();
    overwrite(0, std::string(100, 'x'));
    std::filesystem::copy_file(journal(), copy(), std::filesystem::copy_options::overwrite_existing);
    EXPECT_EQ(try_open().error().code, ErrorCode::corrupt);
    ASSERT_TRUE(recover().ok());
    ASSERT_TRUE(try_open().ok());
    expect_nothing_lost("damaged copy");
}

TEST_F(RecoveryTest, AJournalOfANewerProgramIsLeftAloneUntilAPersonRecovers) {
    fill();
    stop();
    { SQLite::Database{journal().string(), SQLite::OPEN_READWRITE}.exec("PRAGMA user_version=99"); }
    const Result<void> opened = try_open();
    ASSERT_FALSE(opened.ok());
    EXPECT_EQ(opened.error().code, ErrorCode::unsupported);
    EXPECT_THAT(std::string{opened.error().message.view()}, HasSubstr("newer version"));
    EXPECT_THAT(std::string{opened.error().message.view()}, HasSubstr("printd --recover"));
    EXPECT_EQ(set_aside_journals(), 0u);
    ASSERT_TRUE(recover().ok());
    ASSERT_TRUE(try_open().ok());
    expect_nothing_lost("newer");
}

TEST_F(RecoveryTest, TheCopyNeverTakesDamageOver) {
    fill();
    ASSERT_TRUE(copy_journal(state_folder()).ok());
    stop();
    fold();
    const auto before = std::filesystem::file_size(copy());
    const std::uint64_t size = std::filesystem::file_size(journal());
    for (std::uint64_t at = 4096; at < size; at += 4096) overwrite(at, std::string(64, '\x5A'));
    EXPECT_FALSE(copy_journal(state_folder()).ok());
    EXPECT_EQ(std::filesystem::file_size(copy()), before);
    ASSERT_TRUE(try_open().ok());
    expect_nothing_lost("copied while damaged");
}

TEST_F(RecoveryTest, DeletedJobsDoNotComeBackAndWhatDoesNotFitStaysAside) {
    fill();
    ASSERT_TRUE(copy_journal(state_folder()).ok());
    std::filesystem::rename(copy(), folder_ / "earlier");
    ASSERT_TRUE(spool_->remove(10).ok());
    ASSERT_TRUE(spool_->remove(1).ok());
    acknowledged_.erase(10);
    acknowledged_.erase(1);
    upload("no longer printable", {"no.gcode", 1, 0, false});
    const std::string refused = acknowledged_.rbegin()->second;
    acknowledged_.erase(std::prev(acknowledged_.end()));
    stop();
    remove_journal();
    std::filesystem::rename(folder_ / "earlier", copy());
    ASSERT_TRUE(try_open().ok());
    expect_nothing_lost("deleted since the copy");
    EXPECT_FALSE(spool_->find(10).has_value());
    EXPECT_FALSE(spool_->find(1).has_value());
    EXPECT_EQ(blobs().all_set_aside(), std::vector<std::string>{refused});
}

TEST_F(RecoveryTest, APrintThatTheCopyKnowsIsJudgedByWhatTheMachineSays) {
    start_sketch();
    open_spool();
    upload(content_of(3'000'000, 4));
    run(3, 1000);
    ASSERT_EQ(state(1), JobState::printing);
    ASSERT_TRUE(copy_journal(state_folder()).ok());
    run(100);
    ASSERT_EQ(state(1), JobState::done);
    upload("G28\n;second");
    run(20);
    ASSERT_EQ(state(2), JobState::done);
    const std::size_t printed_runs = printed().bytes.size();
    std::filesystem::rename(copy(), folder_ / "earlier");
    stop();
    remove_journal();
    std::filesystem::rename(folder_ / "earlier", copy());
    ASSERT_TRUE(try_open().ok());
    run(100);
    expect_nothing_lost("printing in the copy");
    expect_all_held("printing in the copy");
    EXPECT_EQ(printed().bytes.size(), printed_runs) << "nothing printed again";
    EXPECT_FALSE(spool_->active_run().has_value());
}

// ---- kill -9 between any two steps --------------------------------------------------------------

int steps_left = 0;
void die_at_step(const char*) {
    if (--steps_left == 0) ::kill(::getpid(), SIGKILL);
}

/// Runs `work` in a child that is killed at its `step`th step. False: it had fewer, and ended by
/// itself.
template <typename Work>
bool killed_at(int step, Work&& work) {
    const pid_t child = ::fork();
    if (child == 0) {
        steps_left = step;
        set_journal_step_hook(die_at_step);
        work();
        ::_exit(0);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    return WIFSIGNALED(status);
}

TEST_F(RecoveryTest, ACopyThatIsKilledAtAnyStepLeavesASoundOne) {
    fill();
    ASSERT_TRUE(copy_journal(state_folder()).ok());
    stop();
    int step = 1;
    for (; killed_at(step, [&] { static_cast<void>(copy_journal(state_folder())); }); ++step) {
        EXPECT_TRUE(SqliteStore::open(copy()).ok()) << "step " << step;
        ASSERT_TRUE(try_open().ok()) << "step " << step;
        expect_nothing_lost("copy killed at step " + std::to_string(step));
        EXPECT_TRUE(spool_->gate().hold_reason.empty());
        stop();
        for (const auto& entry : std::filesystem::directory_iterator{state_folder()})
            EXPECT_NE(entry.path().extension(), ".part") << "half of a copy stays";
    }
    EXPECT_GE(step, 5) << "the hook was not called";
}

TEST_F(RecoveryTest, ARepairThatIsKilledAtAnyStepIsDoneAgain) {
    fill();
    kill_with_older_copy();
    const auto pristine = folder_ / "pristine";
    fold();
    overwrite(0, std::string(100, 'x'));
    std::filesystem::copy(state_folder(), pristine, std::filesystem::copy_options::recursive);
    int step = 1;
    for (;; ++step) {
        const bool killed = killed_at(step, [&] { static_cast<void>(try_open()); });
        ASSERT_TRUE(try_open().ok()) << "step " << step;
        expect_nothing_lost("repair killed at step " + std::to_string(step));
        expect_all_held("repair killed at step " + std::to_string(step));
        stop();
        std::filesystem::remove_all(state_folder());
        std::filesystem::copy(pristine, state_folder(), std::filesystem::copy_options::recursive);
        if (!killed) break;
    }
    EXPECT_GE(step, 6) << "the hook was not called";
}

// ---- an old journal -----------------------------------------------------------------------------

// As the program of that time made it.
constexpr const char* kSchemaOfVersion1 = R"sql(
CREATE TABLE IF NOT EXISTS jobs(
  id INTEGER PRIMARY KEY AUTOINCREMENT, name TEXT NOT NULL, size INTEGER NOT NULL, sha256 TEXT NOT NULL,
  state TEXT NOT NULL CHECK(state IN ('queued','printing','done','cancelled','failed')),
  hold INTEGER NOT NULL, copies INTEGER NOT NULL, copies_done INTEGER NOT NULL, priority INTEGER NOT NULL,
  position INTEGER NOT NULL, created_s INTEGER NOT NULL, started_s INTEGER NOT NULL, ended_s INTEGER NOT NULL,
  error TEXT NOT NULL, facts TEXT NOT NULL, estimated_s REAL NOT NULL,
  has_layers INTEGER NOT NULL, has_thumbnail INTEGER NOT NULL) STRICT;
CREATE UNIQUE INDEX IF NOT EXISTS one_prints ON jobs(state) WHERE state = 'printing';
CREATE TABLE IF NOT EXISTS runs(
  id INTEGER PRIMARY KEY, job INTEGER NOT NULL, session INTEGER NOT NULL, length INTEGER NOT NULL,
  cancel_asked INTEGER NOT NULL, inspected INTEGER NOT NULL, outcome TEXT, ended_s INTEGER, report TEXT) STRICT;
CREATE UNIQUE INDEX IF NOT EXISTS one_runs ON runs((1)) WHERE outcome IS NULL;
CREATE INDEX IF NOT EXISTS runs_of_job ON runs(job);
CREATE TABLE IF NOT EXISTS settings(key TEXT PRIMARY KEY, value TEXT NOT NULL) STRICT;
CREATE TABLE IF NOT EXISTS sessions(token_hash TEXT PRIMARY KEY, expires_s INTEGER NOT NULL) STRICT;
)sql";

TEST_F(RecoveryTest, AJournalOfVersion1IsBroughtUpToDate) {
    std::filesystem::create_directories(state_folder() / "blobs");
    const std::string bytes = "G28\n;old";
    std::ofstream{state_folder() / "blobs" / (sha256_of(bytes) + ".gcode")} << bytes;
    {
        SQLite::Database old{journal().string(), SQLite::OPEN_READWRITE | SQLite::OPEN_CREATE};
        old.exec(kSchemaOfVersion1);
        old.exec("PRAGMA user_version=1");
        SQLite::Statement put{old, "INSERT INTO jobs VALUES(?,?,8,?,?,0,1,0,0,?,1000,0,?,'',?,0,0,0)"};
        const auto add_row = [&](int id, const char* state, int position, int ended_s) {
            put.reset();
            put.bind(1, id);
            put.bind(2, "old " + std::to_string(id));
            put.bind(3, sha256_of(bytes));
            put.bind(4, state);
            put.bind(5, position);
            put.bind(6, ended_s);
            put.bind(7, "{}");
            put.exec();
        };
        add_row(1, "done", 9, 300);
        add_row(2, "failed", 8, 100);
        add_row(3, "queued", 7, 0);
        add_row(4, "cancelled", 6, 200);
        add_row(5, "done", 5, 300);
    }
    ASSERT_TRUE(try_open().ok());
    run(60);
    std::vector<JobId> ids;
    const JobPage page = *spool_->page({});
    for (const Job& job : page.jobs) ids.push_back(job.id);
    EXPECT_EQ(ids, (std::vector<JobId>{3, 5, 1, 4, 2})) << "the newest ended first";
    EXPECT_EQ(spool_->counts().done, 2);
    EXPECT_FALSE(spool_->find(2)->stopped_line.has_value());
    EXPECT_EQ(spool_->store().stored_bytes(), 8u);
    EXPECT_TRUE(spool_->gate().hold_reason.empty()) << "its files are its own";
    EXPECT_TRUE(std::filesystem::exists(blobs().path(sha256_of(bytes), BlobPart::gcode)));
    EXPECT_EQ(*add("G28\n;new"), 6);
    ASSERT_TRUE(try_open().ok());
    EXPECT_EQ(spool_->counts().total(), 6);
}

TEST_F(RecoveryTest, AJournalOfVersion2IsBroughtUpToDate) {
    ASSERT_TRUE(try_open().ok());
    const JobId a = *add("G28\n;a");
    spool_.reset();
    {
        SQLite::Database old{journal().string(), SQLite::OPEN_READWRITE};
        old.exec("ALTER TABLE jobs DROP COLUMN stopped_byte");
        old.exec("ALTER TABLE jobs DROP COLUMN printed_s");
        old.exec("PRAGMA user_version=2");
    }
    ASSERT_TRUE(try_open().ok());
    ASSERT_NE(spool_->find(a), std::nullopt);
    EXPECT_FALSE(spool_->find(a)->stopped_byte || spool_->find(a)->printed_s);
}

}  // namespace
}  // namespace qduino::spool::recovery_test
