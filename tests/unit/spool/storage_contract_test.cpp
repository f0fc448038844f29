// What every storage promises its spool: the same tests on a disk and in memory.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <functional>

#include "spool/disk/disk_storage.h"
#include "spool/memory_storage.h"

namespace qduino::spool::storage_contract_test {
namespace {

constexpr std::size_t kFileBytesMax = 1000;

/// A storage, and what a new start of the service makes of it.
class World {
  public:
    virtual ~World() = default;
    [[nodiscard]] virtual Storage& storage() = 0;
    virtual void start_anew() = 0;
};

class OnDisk final : public World {
  public:
    OnDisk() {
        std::string pattern = (std::filesystem::temp_directory_path() / "storage-XXXXXX").string();
        EXPECT_NE(::mkdtemp(pattern.data()), nullptr);
        folder_ = pattern;
        open();
    }
    ~OnDisk() override {
        storage_.reset();
        std::filesystem::remove_all(folder_);
    }
    Storage& storage() override { return *storage_; }
    void start_anew() override {
        storage_.reset();
        open();
    }

  private:
    void open() { storage_ = DiskStorage::open({.folder = folder_, .limits = {kFileBytesMax, 0}}).value(); }
    std::filesystem::path folder_;
    std::unique_ptr<DiskStorage> storage_;
};

/// Memory does not outlive the service; what it holds is read anew.
class InMemory final : public World {
  public:
    Storage& storage() override { return storage_; }
    void start_anew() override {}

  private:
    MemoryStorage storage_{{.places = 4, .file_bytes_max = kFileBytesMax, .layers_bytes_max = 100}};
};

struct Kind {
    const char* name;
    std::function<std::unique_ptr<World>()> make;
};

class StorageContract : public ::testing::TestWithParam<Kind> {
  protected:
    Store& store() { return world_->storage().store(); }
    Files& files() { return world_->storage().files(); }
    StoredState load() { return store().load().value(); }
    void start_anew() { world_->start_anew(); }
    Result<void> put(Job job) {
        Commit commit;
        commit.jobs.put.push_back(std::move(job));
        return store().commit(commit);
    }
    Result<void> erase(JobId id) {
        Commit commit;
        commit.jobs.erase.push_back(id);
        return store().commit(commit);
    }
    std::unique_ptr<StagedFile> sealed(std::string_view bytes) {
        auto file = files().stage().value();
        EXPECT_TRUE(file->write(bytes).ok());
        EXPECT_TRUE(file->seal().ok());
        return file;
    }
    std::optional<std::string> content(const std::string& sha256, FilePart part = FilePart::gcode) {
        const auto bytes = files().content(sha256, part);
        return bytes ? std::optional{read_whole(*bytes).value()} : std::nullopt;
    }

    std::unique_ptr<World> world_ = GetParam().make();
};

Job job_of(JobId id, JobState state, std::int64_t order) {
    Job job;
    job.id = id;
    job.name = "Part " + std::to_string(id) + ".gcode";
    job.sha256 = std::string(63, 'a') + static_cast<char>('0' + id % 10);
    job.state = state;
    job.order = order;
    job.stored_bytes = 100;
    return job;
}

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

std::vector<JobId> ids_of(const Result<std::vector<Job>>& jobs) {
    std::vector<JobId> ids;
    for (const Job& job : *jobs) ids.push_back(job.id);
    return ids;
}

// ---- the store ----------------------------------------------------------------------------------

TEST_P(StorageContract, AJobComesBackFieldByField) {
    ASSERT_TRUE(put(full_job()).ok());
    start_anew();
    const StoredState state = load();
    EXPECT_TRUE(state.jobs.empty()) << "it has ended";
    EXPECT_EQ(state.last_ended, 17);
    EXPECT_EQ(state.newest_s, 300);
    const Job read = store().find(3).value();
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
    EXPECT_EQ(store().counts().failed, 1);
    EXPECT_EQ(store().stored_bytes(), written.stored_bytes);
    EXPECT_EQ(state.next_job_id, 4);
}

TEST_P(StorageContract, WhatWaitsOrPrintsIsLoadedAndCounted) {
    ASSERT_TRUE(put(job_of(1, JobState::done, 1)).ok());
    ASSERT_TRUE(put(job_of(2, JobState::printing, 2)).ok());
    ASSERT_TRUE(put(job_of(5, JobState::queued, 3)).ok());
    start_anew();
    EXPECT_EQ(ids_of(load().jobs), (std::vector<JobId>{2, 5}));
    EXPECT_EQ(store().counts().queued, 1);
    EXPECT_EQ(store().counts().printing, 1);
    EXPECT_EQ(store().counts().ended(), 1);
    EXPECT_EQ(load().next_job_id, 6);
}

TEST_P(StorageContract, NumbersOfErasedJobsAreNotGivenAgain) {
    ASSERT_TRUE(put(full_job()).ok());
    ASSERT_TRUE(erase(3).ok());
    start_anew();
    EXPECT_EQ(store().find(3).error().code, ErrorCode::not_found);
    EXPECT_EQ(store().counts().total(), 0);
    EXPECT_EQ(store().stored_bytes(), 0u);
    EXPECT_EQ(load().next_job_id, 4);
}

TEST_P(StorageContract, ARunIsActiveUntilItsEndIsCommitted) {
    Commit begin;
    begin.run_begun = spool::Run{9, 3, ~std::uint64_t{0}, 1000, false, true};
    ASSERT_TRUE(store().commit(begin).ok());
    start_anew();
    ASSERT_TRUE(load().active_run.has_value());
    EXPECT_EQ(load().active_run->session, ~std::uint64_t{0});
    EXPECT_EQ(load().last_run_id, 9u);
    Commit cancel;
    cancel.run_changed = load().active_run;
    cancel.run_changed->cancel_asked = true;
    ASSERT_TRUE(store().commit(cancel).ok());
    EXPECT_TRUE(load().active_run->cancel_asked);

    Commit end;
    end.run_ended = Commit::RunEnd{9, "completed", 5};
    ASSERT_TRUE(store().commit(end).ok());
    start_anew();
    EXPECT_FALSE(load().active_run.has_value());
    ASSERT_TRUE(load().awaited_report.has_value()) << "the inspector still owes its report";
    Commit report;
    report.report.emplace(9, "{}");
    ASSERT_TRUE(store().commit(report).ok());
    EXPECT_FALSE(load().awaited_report.has_value());
    EXPECT_EQ(*store().report_of(3), "{}");
    EXPECT_EQ(store().report_of(4).error().code, ErrorCode::not_found);
    ASSERT_TRUE(put(job_of(3, JobState::done, 1)).ok());
    ASSERT_TRUE(erase(3).ok());
    EXPECT_EQ(store().report_of(3).error().code, ErrorCode::not_found);
    EXPECT_EQ(load().last_run_id, 9u) << "a run's number is never given again";
}

TEST_P(StorageContract, TwoRunsAndTwoPrintingJobsAreForbidden) {
    Commit begin;
    begin.run_begun = spool::Run{1, 3, 1, 1, false, false};
    ASSERT_TRUE(store().commit(begin).ok());
    begin.run_begun = spool::Run{2, 3, 1, 1, false, false};
    EXPECT_FALSE(store().commit(begin).ok());
    Commit jobs;
    for (const JobId id : {1, 2}) jobs.jobs.put.push_back(job_of(id, JobState::printing, id));
    EXPECT_FALSE(store().commit(jobs).ok());
    EXPECT_TRUE(load().jobs.empty()) << "half of a commit is nothing";
    EXPECT_EQ(load().active_run->id, 1u);
}

TEST_P(StorageContract, SessionsAndTheGateAreKept) {
    ASSERT_TRUE(store().put_session({"aa", 10}).ok());
    ASSERT_TRUE(store().put_session({"bb", 20}).ok());
    ASSERT_TRUE(store().put_session({"bb", 30}).ok());
    Commit commit;
    commit.gate = QueueGate{"a job failed", true};
    ASSERT_TRUE(store().commit(commit).ok());
    start_anew();
    ASSERT_TRUE(store().keep_sessions(1).ok());
    ASSERT_EQ(store().sessions()->size(), 1u);
    EXPECT_EQ(store().sessions()->front().expires_s, 30);
    EXPECT_EQ(load().gate.hold_reason, "a job failed");
    EXPECT_TRUE(load().gate.bed_occupied);
    ASSERT_TRUE(store().erase_session("bb").ok());
    EXPECT_TRUE(store().sessions()->empty());
}

TEST_P(StorageContract, EndedJobsComeInPagesAndByTheirNames) {
    for (JobId id = 1; id <= 6; ++id) {
        Job job = job_of(id, id % 2 == 0 ? JobState::done : JobState::cancelled, 10 + id);
        job.ended_s = 1000 * id;
        ASSERT_TRUE(put(std::move(job)).ok());
    }
    ASSERT_TRUE(put(job_of(7, JobState::queued, 1)).ok());
    EXPECT_EQ(ids_of(store().ended({.limit = 2})), (std::vector<JobId>{6, 5}));
    EXPECT_EQ(ids_of(store().ended({.limit = 2, .below_order = 15})), (std::vector<JobId>{4, 3}));
    EXPECT_EQ(ids_of(store().ended({.states = {JobState::done}})), (std::vector<JobId>{6, 4, 2}));
    EXPECT_EQ(ids_of(store().ended({.text = "PART 3"})), std::vector<JobId>{3});
    EXPECT_EQ(ids_of(store().oldest_ended(2)), (std::vector<JobId>{1, 2}));
    EXPECT_EQ(ids_of(store().oldest_ended(9, 4000, 2000)), (std::vector<JobId>{2, 3, 4}));
}

TEST_P(StorageContract, SharedFilesCountOnceAndAreWantedUntilTheLastJobGoes) {
    for (const JobId id : {1, 11, 2}) ASSERT_TRUE(put(job_of(id, JobState::done, id)).ok());
    const std::string shared = job_of(1, JobState::done, 1).sha256;
    EXPECT_EQ(store().stored_bytes(), 200u);
    EXPECT_TRUE(*store().blob_wanted(shared, 1));
    ASSERT_TRUE(erase(1).ok());
    EXPECT_EQ(store().stored_bytes(), 200u);
    EXPECT_TRUE(*store().blob_wanted(shared));
    ASSERT_TRUE(erase(11).ok());
    EXPECT_EQ(store().stored_bytes(), 100u);
    EXPECT_FALSE(*store().blob_wanted(shared));
}

// ---- files --------------------------------------------------------------------------------------

TEST_P(StorageContract, AdoptsWhatWasSealed) {
    auto file = sealed("abc");
    const std::string name = file->sha256();
    EXPECT_EQ(name, "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    EXPECT_EQ(read_whole(*file->content()).value(), "abc");
    ASSERT_TRUE(file->layers().write(std::string_view{"lay"}).ok());
    ASSERT_TRUE(file->layers().write(std::string_view{"ers"}).ok());
    EXPECT_EQ(stored_bytes_of(*file, {"[1]", "png"}), 15u);
    EXPECT_FALSE(content(name)) << "not yet";
    ASSERT_TRUE(files().adopt(*file, {"[1]", "png"}, {7, 100, "a b.gcode"}).ok());
    files().confirm(name);
    file.reset();
    EXPECT_EQ(content(name), "abc");
    EXPECT_EQ(content(name, FilePart::layers), "layers");
    EXPECT_EQ(content(name, FilePart::layers_index), "[1]");
    EXPECT_EQ(content(name, FilePart::thumbnail), "png");
    const auto held = files().content(name, FilePart::gcode);
    files().remove(name);
    EXPECT_FALSE(content(name));
    EXPECT_EQ(read_whole(*held).value(), "abc") << "whoever reads it reads it to its end";
}

TEST_P(StorageContract, ReadsFromAnyPlace) {
    auto file = sealed("abcdef");
    ASSERT_TRUE(files().adopt(*file, {}, {1, 1, "a"}).ok());
    const auto bytes = files().content(file->sha256(), FilePart::gcode);
    char some[3];
    EXPECT_EQ(bytes->size(), 6u);
    EXPECT_EQ(bytes->read_at(4, some).value(), 2u);
    EXPECT_EQ((std::string_view{some, 2}), "ef");
    EXPECT_EQ(bytes->read_at(6, some).value(), 0u);
    EXPECT_EQ(files().content(file->sha256(), FilePart::thumbnail), nullptr) << "there is none";
}

TEST_P(StorageContract, TheSameBytesTwiceAreOneFile) {
    for (const JobId id : {1, 2}) {
        auto file = sealed("abc");
        ASSERT_TRUE(files().adopt(*file, {}, {id, 100, "a.gcode"}).ok());
        files().confirm(file->sha256());
    }
    const std::string name = sealed("abc")->sha256();
    files().forget(name, 1);
    EXPECT_EQ(content(name), "abc");
    files().remove(name);
    EXPECT_FALSE(content(name));
}

TEST_P(StorageContract, TooLongIsRefusedAtTheLimit) {
    auto file = files().stage().value();
    ASSERT_TRUE(file->write(std::string(kFileBytesMax, 'x')).ok());
    EXPECT_EQ(file->write(std::string_view{"y"}).error().code, ErrorCode::out_of_range);
    EXPECT_EQ(files().size_max_bytes(), kFileBytesMax);
}

TEST_P(StorageContract, WhatIsAbandonedLeavesNothing) {
    for (int i = 0; i < 20; ++i) {
        auto file = files().stage();
        ASSERT_TRUE(file.ok()) << i;
        ASSERT_TRUE((*file)->write(std::string_view{"abc"}).ok());
    }
}

INSTANTIATE_TEST_SUITE_P(Worlds, StorageContract,
                         ::testing::Values(Kind{"disk", [] { return std::make_unique<OnDisk>(); }},
                                           Kind{"memory", [] { return std::make_unique<InMemory>(); }}),
                         [](const auto& kind) { return std::string{kind.param.name}; });

// ---- what memory alone promises -----------------------------------------------------------------

TEST(MemoryStorage, AsksForRoomAndRefusesWhatFindsNone) {
    MemoryStorage storage{{.places = 2, .file_bytes_max = 100, .layers_bytes_max = 4}};
    auto first = storage.files().stage().value();
    auto second = storage.files().stage().value();
    EXPECT_EQ(storage.files().stage().error().code, ErrorCode::unavailable);
    storage.files().when_full([&] {
        const bool had = second != nullptr;
        second.reset();
        return had;
    });
    EXPECT_TRUE(storage.files().stage().ok());
    EXPECT_EQ(first->layers().write(std::string_view{"12345"}).error().code, ErrorCode::out_of_range);
}

TEST(MemoryStorage, TheBedIsOccupiedUntilSomebodyLooks) {
    MemoryStorage storage{{.places = 1, .file_bytes_max = 1, .layers_bytes_max = 1}};
    EXPECT_TRUE(storage.load()->gate.bed_occupied);
    EXPECT_FALSE(storage.is_durable());
}

TEST(MemoryStorage, JobsAreBounded) {
    MemoryStore store;
    for (JobId id = 1; id <= static_cast<JobId>(MemoryStore::kJobsMax) + 1; ++id) {
        Commit commit;
        commit.jobs.put.push_back(job_of(id, JobState::queued, id));
        const Result<void> done = store.commit(commit);
        EXPECT_EQ(done.ok(), id <= static_cast<JobId>(MemoryStore::kJobsMax)) << id;
    }
}

}  // namespace
}  // namespace qduino::spool::storage_contract_test
