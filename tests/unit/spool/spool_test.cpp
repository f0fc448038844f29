// The spool as a whole, with the stand-in sketch: the bytes printed are the bytes uploaded, once,
// whichever side stops when.
#include <gmock/gmock.h>

#include <fstream>
#include <random>
#include <thread>

#include "tests/unit/spool/spool_fixture.h"

namespace qduino::spool::spool_test {
namespace {

using printer::link::JobOutcome;
using printer::link::MachineState;
using ::testing::HasSubstr;

TEST_F(SpoolTest, PrintsJobAfterJobInOrder) {
    start_sketch();
    open_spool();
    const std::string first = content_of(3'000'000, 1), second = content_of(10, 2);
    const JobId a = *add(first), b = *add(second);
    run(30);
    EXPECT_EQ(state(a), JobState::done);
    EXPECT_EQ(state(b), JobState::done);
    EXPECT_EQ(printed().bytes.at(1), first);
    EXPECT_EQ(printed().bytes.at(2), second);
    EXPECT_EQ(printed().outcomes.at(2), JobOutcome::completed);
}

TEST_F(SpoolTest, CopiesAreRunsOfTheirOwn) {
    start_sketch();
    open_spool();
    const JobId a = *add("G28\n", {"", 3, 0, false});
    run(40);
    EXPECT_EQ(state(a), JobState::done);
    EXPECT_EQ(printed().bytes.size(), 3u);
    for (const auto& [id, bytes] : printed().bytes) EXPECT_EQ(bytes, "G28\n") << id;
}

TEST_F(SpoolTest, TheQueueWaitsForAMachineAndSurvivesARestart) {
    open_spool();
    const JobId a = *add("G28\n"), b = *add("G29\n", {"later.gcode", 2, 7, true});
    run(5);
    EXPECT_EQ(state(a), JobState::queued);
    open_spool();
    const std::optional<Job> job = spool_->find(b);
    ASSERT_TRUE(job.has_value());
    EXPECT_EQ(job->name, "later.gcode");
    EXPECT_EQ(job->copies, 2);
    EXPECT_EQ(job->priority, 7);
    EXPECT_TRUE(job->hold);
    start_sketch();
    run(20);
    EXPECT_EQ(state(a), JobState::done);
    EXPECT_EQ(state(b), JobState::queued);
}

TEST_F(SpoolTest, ARestartedServiceFeedsOnFromWhereTheSketchIs) {
    start_sketch();
    open_spool();
    const std::string content = content_of(2'500'000, 3);
    const JobId a = *add(content);
    for (int restart = 0; restart < 12; ++restart) {
        run(3, 50'000);
        open_spool();
    }
    run(40);
    EXPECT_EQ(state(a), JobState::done);
    EXPECT_EQ(printed().bytes.size(), 1u);
    EXPECT_EQ(printed().bytes.at(1), content);
}

TEST_F(SpoolTest, AnOutcomeReportedWhileTheServiceWasDownIsRecorded) {
    start_sketch();
    open_spool();
    const JobId a = *add("G28\n");
    for (int i = 0; i < 3 && sketch_->status().bytes_accepted < 4; ++i) run(1);
    run(1, 0);
    now_ += std::chrono::milliseconds{20};
    spool_->tick(now_, 1);  // job_end is in the ring
    spool_.reset();
    sketch_->step(1 << 20);
    ASSERT_EQ(printed().outcomes.count(1), 1u);
    open_spool();
    EXPECT_EQ(state(a), JobState::printing);
    run(20);
    EXPECT_EQ(state(a), JobState::done);
    EXPECT_EQ(printed().bytes.at(1), "G28\n");
}

TEST_F(SpoolTest, ASketchStartedAnewFailsTheJobAndHoldsTheQueue) {
    start_sketch();
    open_spool();
    const JobId a = *add(content_of(3'000'000, 4)), b = *add("G28\n");
    run(3, 1000);
    EXPECT_EQ(state(a), JobState::printing);
    start_sketch();
    run(5);
    EXPECT_EQ(state(a), JobState::failed);
    EXPECT_THAT(spool_->find(a)->error, HasSubstr("started anew"));
    EXPECT_THAT(spool_->gate().hold_reason, HasSubstr("failed"));
    run(20);
    EXPECT_EQ(state(b), JobState::queued) << "nothing moves before a person says so";
    EXPECT_TRUE(printed().bytes.empty());
    open_spool();
    EXPECT_FALSE(spool_->gate().hold_reason.empty()) << "the hold is durable";
    ASSERT_TRUE(spool_->release_queue().ok());
    run(20);
    EXPECT_EQ(state(b), JobState::done);
}

TEST_F(SpoolTest, AfterFailureContinueGoesOnWithTheNextJob) {
    options_.hold_after_failure = false;
    start_sketch();
    open_spool();
    const JobId a = *add(content_of(3'000'000, 4)), b = *add("G28\n");
    run(3, 1000);
    start_sketch();
    run(30);
    EXPECT_EQ(state(a), JobState::failed);
    EXPECT_EQ(state(b), JobState::done);
}

TEST_F(SpoolTest, AnOutcomeGivenJustBeforeTheSketchEndedCounts) {
    start_sketch();
    open_spool();
    const JobId a = *add("G28\n");
    run(2, 0);
    sketch_->step(1 << 20);  // takes it all
    now_ += std::chrono::milliseconds{20};
    spool_->tick(now_, 1);   // sends job_end
    sketch_->step(1 << 20);  // completed …
    start_sketch();          // … and gone
    run(3);
    EXPECT_EQ(state(a), JobState::done);
}

TEST_F(SpoolTest, ADeadSketchFailsTheJobAndKeepsTheQueue) {
    start_sketch();
    open_spool();
    const JobId a = *add(content_of(3'000'000, 4)), b = *add("G28\n");
    run(3, 1000);
    layout_->sketch_dead.store(1);
    sketch_.reset();
    run(60);
    EXPECT_EQ(state(a), JobState::failed);
    EXPECT_THAT(spool_->find(a)->error, HasSubstr("died"));
    EXPECT_EQ(state(b), JobState::queued);
}

TEST_F(SpoolTest, TheJobOfADeadSketchSaysWhatItsSupervisorSays) {
    start_sketch();
    open_spool();
    const JobId a = *add(content_of(3'000'000, 4));
    run(3, 1000);
    layout_->sketch_dead.store(2);
    sketch_.reset();
    run(3);
    EXPECT_EQ(state(a), JobState::printing) << "the reason may still come";
    constexpr std::string_view kNote =
        "loop 2 hung: core 1 was taken by stress-ng (pid 4711, SCHED_FIFO 85)\n";
    std::copy(kNote.begin(), kNote.end(), layout_->death_note.begin());
    layout_->death_note_ready.store(1);
    run(1);
    EXPECT_EQ(state(a), JobState::failed);
    EXPECT_EQ(spool_->find(a)->error,
              "loop 2 hung: core 1 was taken by stress-ng (pid 4711, SCHED_FIFO 85) ");
}

TEST_F(SpoolTest, WithoutASupervisorsReasonTheJobFailsAfterASecondAllTheSame) {
    start_sketch();
    open_spool();
    const JobId a = *add(content_of(3'000'000, 4));
    run(3, 1000);
    layout_->sketch_dead.store(1);
    sketch_.reset();
    run(1);
    now_ += MachineLink::kExplainedWithin - std::chrono::milliseconds{100};
    run(1);
    EXPECT_EQ(state(a), JobState::printing);
    now_ += std::chrono::milliseconds{200};
    run(1);
    EXPECT_EQ(state(a), JobState::failed);
    EXPECT_THAT(spool_->find(a)->error, HasSubstr("died"));
}

TEST_F(SpoolTest, CancelIsDurableAndReachesAMachineThatHasNotBegun) {
    start_sketch();
    open_spool();
    const JobId a = *add(content_of(3'000'000, 4));
    now_ += std::chrono::milliseconds{20};
    spool_->tick(now_, 1);
    spool_->tick(now_, 1);
    ASSERT_TRUE(spool_->cancel().ok());
    open_spool();  // killed before the command crossed
    for (int i = 0; i < 100; ++i) run(1, 100);
    EXPECT_EQ(state(a), JobState::cancelled);
    EXPECT_EQ(printed().outcomes.at(1), JobOutcome::cancelled);
}

TEST_F(SpoolTest, PauseAndResumeApplyOnlyWhenTheyDo) {
    start_sketch();
    open_spool();
    run(2);
    EXPECT_EQ(spool_->pause().error().code, ErrorCode::not_permitted);
    EXPECT_EQ(spool_->resume().error().code, ErrorCode::not_permitted);
    EXPECT_EQ(spool_->cancel().error().code, ErrorCode::not_permitted);
    EXPECT_EQ(spool_->clear_fault().error().code, ErrorCode::not_permitted);
    const JobId a = *add(content_of(2'000'000, 5));
    run(3, 1000);
    ASSERT_TRUE(spool_->pause().ok());
    run(2, 1000);
    EXPECT_EQ(sketch_->status().state, MachineState::paused);
    const auto held = sketch_->status().bytes_accepted;
    run(50, 1000);
    EXPECT_EQ(sketch_->status().bytes_accepted, held);
    ASSERT_TRUE(spool_->resume().ok());
    run(100);
    EXPECT_EQ(state(a), JobState::done);
}

TEST_F(SpoolTest, APauseRightAfterTheBeginIsNotLost) {
    start_sketch();
    open_spool();
    run(2);
    const JobId a = *add(content_of(2'000'000, 5));
    now_ += std::chrono::milliseconds{20};
    spool_->tick(now_, 1);  // begun, and the sketch has not seen it
    ASSERT_EQ(state(a), JobState::printing);
    ASSERT_TRUE(spool_->pause().ok());
    run(10, 1000);
    EXPECT_EQ(sketch_->status().state, MachineState::paused);
    ASSERT_TRUE(spool_->resume().ok());
    run(100);
    EXPECT_EQ(state(a), JobState::done);
}

TEST_F(SpoolTest, AnEmergencyStopFailsTheJobAndNeedsNoTick) {
    start_sketch();
    open_spool();
    EXPECT_EQ(spool_->emergency().stop().error().code, ErrorCode::unavailable);
    const JobId a = *add(content_of(2'000'000, 5));
    run(4, 1000);
    std::thread{[&] { EXPECT_TRUE(spool_->emergency().stop().ok()); }}.join();
    run(3, 1000);
    EXPECT_EQ(state(a), JobState::failed);
    EXPECT_EQ(spool_->find(a)->error, "emergency stop");
    EXPECT_EQ(spool_->machine().job.state, MachineState::faulted);
    ASSERT_TRUE(spool_->clear_fault().ok());
    run(3, 1000);
    EXPECT_EQ(spool_->machine().job.state, MachineState::idle);
}

TEST_F(SpoolTest, CommandsCrossInOrderAndRepliesComeBack) {
    start_sketch();
    open_spool();
    EXPECT_EQ(spool_->gcode(std::vector<std::string>{"M105"}).error().code, ErrorCode::unavailable);
    run(2);
    ASSERT_TRUE(spool_->gcode(std::vector<std::string>{"G91", "G1 X10 F3000", "G90"}).ok());
    run(2);
    EXPECT_THAT(printed().gcode, ::testing::ElementsAre("G91", "G1 X10 F3000", "G90"));
    EXPECT_EQ(spool_->take_replies().size(), 3u);
    EXPECT_EQ(spool_->gcode(std::vector<std::string>{"G1\nG2"}).error().code, ErrorCode::invalid_argument);
    EXPECT_EQ(spool_->gcode(std::vector<std::string>{std::string(300, 'G')}).error().code,
              ErrorCode::invalid_argument);
}

TEST_F(SpoolTest, ASilentSketchIsGivenNothing) {
    start_sketch();
    open_spool();
    run(3);
    sketch_.reset();
    run(200);
    const JobId a = *add("G28\n");
    run(10);
    EXPECT_EQ(state(a), JobState::queued);
    EXPECT_EQ(spool_->gcode(std::vector<std::string>{"M105"}).error().code, ErrorCode::unavailable);
}

TEST_F(SpoolTest, DamagedFramesInTheJobRingAreSentAgain) {
    start_sketch();
    open_spool();
    const std::string content = content_of(500'000, 6);
    const JobId a = *add(content);
    std::mt19937_64 random{42};
    for (int i = 0; i < 600 && state(a) != JobState::done; ++i) {
        if (random() % 10 == 0) {
            const std::vector<std::uint8_t> junk(random() % 100 + 1, 0x5A);
            layout_->jobs.discard_all();
            static_cast<void>(layout_->jobs.try_push_all(junk));
        }
        run(1, 20'000);
    }
    EXPECT_EQ(state(a), JobState::done);
    EXPECT_EQ(printed().bytes.at(1), content);
    EXPECT_GT(sketch_->corrupt_count(), 0u);
}

TEST_F(SpoolTest, TheBedIsConfirmedBetweenCopies) {
    options_.confirm_bed = true;
    start_sketch();
    open_spool();
    const JobId a = *add("G28\n", {"", 2, 0, false});
    run(20);
    EXPECT_EQ(spool_->find(a)->copies_done, 1);
    open_spool();
    run(20);
    EXPECT_EQ(spool_->find(a)->copies_done, 1);
    ASSERT_TRUE(spool_->bed_cleared().ok());
    run(20);
    EXPECT_EQ(state(a), JobState::done);
}

TEST_F(SpoolTest, BedConfirmationIsOnByDefaultAndACopyThatMovedOccupiesIt) {
    options_.confirm_bed = SpoolOptions{}.confirm_bed;
    start_sketch();
    open_spool();
    EXPECT_TRUE(spool_->confirms_bed());
    const JobId cancelled = *add(content_of(2'000'000, 5)), failed = *add(content_of(2'000'000, 6));
    run(4, 1000);
    ASSERT_TRUE(spool_->cancel().ok());
    run(100, 1000);
    ASSERT_EQ(state(cancelled), JobState::cancelled);
    EXPECT_TRUE(spool_->gate().bed_occupied);
    EXPECT_EQ(state(failed), JobState::queued) << "it would home through the last part";
    ASSERT_TRUE(spool_->bed_cleared().ok());
    run(4, 1000);
    ASSERT_EQ(state(failed), JobState::printing);
    start_sketch();
    run(5);
    EXPECT_EQ(state(failed), JobState::failed);
    EXPECT_TRUE(spool_->gate().bed_occupied) << "nobody knows what lies there";
}

TEST_F(SpoolTest, AJobThatNeverReachedTheMachineLeavesTheBedClear) {
    options_.confirm_bed = true;
    options_.hold_after_failure = false;
    open_spool();
    const JobId a = *add("G28\n"), b = *add("G29\n");
    std::ofstream{blobs().path(spool_->find(a)->sha256, BlobPart::gcode)} << "G";
    start_sketch();
    run(30);
    EXPECT_EQ(state(a), JobState::failed);
    EXPECT_EQ(state(b), JobState::done);
}

TEST_F(SpoolTest, SwitchedOffNobodyIsAskedAboutTheBedAnyMore) {
    options_.confirm_bed = true;
    start_sketch();
    open_spool();
    const JobId a = *add("G28\n", {"", 2, 0, false});
    run(20);
    ASSERT_TRUE(spool_->gate().bed_occupied);
    options_.confirm_bed = false;
    open_spool();
    EXPECT_FALSE(spool_->confirms_bed());
    run(20);
    EXPECT_EQ(state(a), JobState::done);
}

TEST_F(SpoolTest, AStoppedJobKeepsTheLineAndTheLayerWhereItStopped) {
    start_sketch();
    open_spool();
    const JobId stopped = *add(content_of(2'000'000, 5)), done = *add("G28\n");
    run(4, 1000);
    sketch_->stand_at(812, 14);
    run(1, 1000);
    std::thread{[&] { EXPECT_TRUE(spool_->emergency().stop().ok()); }}.join();
    run(3, 1000);
    ASSERT_EQ(state(stopped), JobState::failed);
    open_spool();
    EXPECT_EQ(spool_->find(stopped)->stopped_line, 812);
    EXPECT_EQ(spool_->find(stopped)->stopped_layer, 14);
    ASSERT_TRUE(spool_->find(stopped)->stopped_byte.has_value());
    EXPECT_GT(*spool_->find(stopped)->stopped_byte, 0);
    EXPECT_LT(*spool_->find(stopped)->stopped_byte, 2'000'000);
    ASSERT_TRUE(spool_->release_queue().ok());
    run(2);
    ASSERT_TRUE(spool_->clear_fault().ok());
    run(30);
    ASSERT_EQ(state(done), JobState::done);
    EXPECT_FALSE(spool_->find(done)->stopped_line.has_value()) << "it did not stop";
    EXPECT_FALSE(spool_->find(done)->stopped_byte.has_value());
    EXPECT_TRUE(spool_->find(done)->printed_s.has_value()) << "the printer's own time";
    ASSERT_TRUE(spool_->start(stopped).ok());
    EXPECT_FALSE(spool_->find(stopped)->stopped_line.has_value()) << "it prints again";
}

TEST_F(SpoolTest, WhereAJobStoppedIsKnownAlsoWhenItsSketchIsGone) {
    start_sketch();
    open_spool();
    const JobId a = *add(content_of(2'000'000, 5));
    run(4, 1000);
    sketch_->stand_at(99, 2);
    run(2, 1000);
    start_sketch();
    run(5);
    ASSERT_EQ(state(a), JobState::failed);
    EXPECT_EQ(spool_->find(a)->stopped_line, 99);
    EXPECT_EQ(spool_->find(a)->stopped_layer, 2);
}

TEST_F(SpoolTest, RunNumbersGoOnAboveWhatTheSketchHasSeenWhenTheJournalIsNew) {
    start_sketch();
    open_spool();
    static_cast<void>(*add("G28\n", {"", 3, 0, false}));
    run(40);
    spool_.reset();
    disk_.folder = folder_ / "another";
    open_spool();
    const JobId a = *add("G29\n");
    run(20);
    EXPECT_EQ(state(a), JobState::done);
    EXPECT_EQ(printed().bytes.at(4), "G29\n");
}

TEST_F(SpoolTest, ADamagedFileFailsItsJobOnly) {
    open_spool();
    const JobId a = *add("G28\n"), b = *add("G29\n");
    const auto file = blobs().path(spool_->find(a)->sha256, BlobPart::gcode);
    std::ofstream{file} << "G";
    options_.hold_after_failure = false;
    open_spool();
    start_sketch();
    run(30);
    EXPECT_EQ(state(a), JobState::failed);
    EXPECT_THAT(spool_->find(a)->error, HasSubstr("length"));
    EXPECT_EQ(state(b), JobState::done);
}

TEST_F(SpoolTest, BlobsLiveAsLongAsAJobNamesThem) {
    open_spool();
    const JobId a = *add("G28\n"), b = *add("G28\n");
    const auto file = blobs().path(spool_->find(a)->sha256, BlobPart::gcode);
    ASSERT_TRUE(spool_->remove(a).ok());
    EXPECT_TRUE(std::filesystem::exists(file));
    ASSERT_TRUE(spool_->remove(b).ok());
    EXPECT_FALSE(std::filesystem::exists(file));
}

/// Answers on the third asking, and remembers the order of what it was told.
class SlowInspector final : public Inspector {
  public:
    void begin(std::uint64_t run, const std::string&) override {
        told.push_back("begin " + std::to_string(run));
    }
    bool begun(std::uint64_t) override { return ++asked > 3; }
    void typed(std::uint64_t run, std::uint32_t number, std::uint64_t behind, double left_mm,
               const std::string& line) override {
        told.push_back(
            text<std::string>("typed ", run, ' ', number, ' ', behind, ' ', Shortest{left_mm}, ' ', line));
    }
    void end(std::uint64_t run, std::uint32_t) override { told.push_back("end " + std::to_string(run)); }
    std::optional<std::string> report(std::uint64_t) override {
        if (++asked_report < 3) return std::nullopt;
        return R"({"completed":true})";
    }
    std::vector<std::string> told;
    int asked = 0, asked_report = 0;
};

TEST_F(SpoolTest, TheInspectorIsToldBeforeTheFirstByteAndItsReportIsStored) {
    SlowInspector inspector;
    inspector_ = &inspector;
    start_sketch();
    open_spool();
    const JobId a = *add("G28\n");
    run(2);
    EXPECT_TRUE(printed().bytes.empty());
    run(20);
    EXPECT_EQ(state(a), JobState::done);
    EXPECT_EQ(*spool_->store().report_of(a), R"({"completed":true})");
    EXPECT_EQ(inspector.told.front(), "begin 1");
    EXPECT_EQ(inspector.told.back(), "end 1");
    spool_.reset();
    inspector_ = nullptr;
}

TEST_F(SpoolTest, RandomKillsOfTheServiceNeverLoseOrRepeatAByte) {
    const std::uint64_t seed = 7;
    std::mt19937_64 random{seed};
    start_sketch();
    open_spool();
    std::map<JobId, std::string> uploaded;
    for (int i = 0; i < 300; ++i) {
        if (uploaded.size() < 12 && random() % 4 == 0) {
            const std::string content = content_of(1 + random() % 2'000'000, static_cast<unsigned>(i));
            uploaded[*add(content)] = content;
        }
        for (std::uint64_t ticks = random() % 4; ticks > 0; --ticks) {
            now_ += std::chrono::milliseconds{20};
            spool_->tick(now_, 1);
        }
        for (std::uint64_t steps = random() % 3; steps > 0; --steps) sketch_->step(random() % 300'000);
        if (random() % 3 == 0) open_spool();
    }
    run(200);
    std::vector<std::string> printed_bytes, expected;
    for (const auto& [id, bytes] : printed().bytes) printed_bytes.push_back(bytes);
    for (const auto& [id, content] : uploaded) {
        expected.push_back(content);
        EXPECT_EQ(state(id), JobState::done) << "seed " << seed << " job " << id;
    }
    EXPECT_EQ(printed_bytes, expected) << "seed " << seed;
}

}  // namespace
}  // namespace qduino::spool::spool_test
