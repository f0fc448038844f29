// The decision about a run: every combination of what the journal holds and what the machine says.
#include "spool/run.h"

#include <gtest/gtest.h>

#include <cstring>

namespace qduino::spool::run_test {
namespace {

using printer::link::JobOutcome;
using printer::link::MachineState;
using Kind = RunAction::Kind;

constexpr std::uint64_t kSession = 77;
const Run kRun{5, 1, kSession, 1000, false, false};

MachineView machine(std::uint64_t job_id, JobOutcome outcome, std::uint64_t accepted = 0) {
    MachineView view;
    view.connected = true;
    view.session = kSession;
    view.job.job_id = job_id;
    view.job.outcome = outcome;
    view.job.bytes_accepted = accepted;
    view.job.state = outcome == JobOutcome::running ? MachineState::printing : MachineState::idle;
    return view;
}

TEST(Run, WaitsWhileNoMachineIsThere) { EXPECT_EQ(decide(kRun, MachineView{}).kind, Kind::wait); }

TEST(Run, BeginsWhatTheSketchHasNotSeen) {
    EXPECT_EQ(decide(kRun, machine(0, JobOutcome::none)).kind, Kind::begin);
    EXPECT_EQ(decide(kRun, machine(4, JobOutcome::completed)).kind, Kind::begin);
}

TEST(Run, FeedsFromWhereTheSketchAcknowledged) {
    const RunAction action = decide(kRun, machine(5, JobOutcome::running, 321));
    EXPECT_EQ(action.kind, Kind::feed);
    EXPECT_EQ(action.offset, 321u);
    EXPECT_EQ(decide(kRun, machine(5, JobOutcome::running, 5000)).offset, 1000u)
        << "never past the job's end";
}

TEST(Run, TakesTheOutcome) {
    EXPECT_EQ(decide(kRun, machine(5, JobOutcome::completed)).kind, Kind::completed);
    EXPECT_EQ(decide(kRun, machine(5, JobOutcome::cancelled)).kind, Kind::cancelled);
    MachineView failed = machine(5, JobOutcome::failed);
    failed.job.fault = "hot end is not heating";
    EXPECT_EQ(decide(kRun, failed).kind, Kind::failed);
    EXPECT_EQ(decide(kRun, failed).reason, "hot end is not heating");
    failed.job.fault = "";
    EXPECT_FALSE(decide(kRun, failed).reason.empty());
}

TEST(Run, AnotherSessionIsAFailureAndNeverASecondPrint) {
    MachineView other = machine(0, JobOutcome::none);
    other.session = kSession + 1;
    EXPECT_EQ(decide(kRun, other).kind, Kind::failed);
    other.job.job_id = 5;
    other.job.outcome = JobOutcome::running;
    EXPECT_EQ(decide(kRun, other).kind, Kind::failed);
}

TEST(Run, ADeadSketchFailsTheRunButNotOneItHadFinished) {
    for (const SketchLife life : {SketchLife::died, SketchLife::hung}) {
        MachineView dead = machine(5, JobOutcome::running, 10);
        dead.life = life;
        EXPECT_EQ(decide(kRun, dead).kind, Kind::failed);
        dead = machine(4, JobOutcome::completed);
        dead.life = life;
        EXPECT_EQ(decide(kRun, dead).kind, Kind::failed);
        dead = machine(5, JobOutcome::completed);
        dead.life = life;
        EXPECT_EQ(decide(kRun, dead).kind, Kind::completed);
    }
}

TEST(Run, ADeadSketchFailsWithTheReasonThatItsSupervisorGives) {
    MachineView dead = machine(5, JobOutcome::running, 10);
    dead.life = SketchLife::hung;
    dead.may_be_explained = true;
    EXPECT_EQ(decide(kRun, dead).kind, Kind::wait) << "the reason may still come";
    dead.death_note = "loop 2 hung: core 1 was taken by stress-ng (pid 4711, SCHED_FIFO 85)";
    EXPECT_EQ(decide(kRun, dead).kind, Kind::failed);
    EXPECT_EQ(decide(kRun, dead).reason, dead.death_note);
    dead = machine(5, JobOutcome::completed);
    dead.life = SketchLife::died;
    dead.may_be_explained = true;
    EXPECT_EQ(decide(kRun, dead).kind, Kind::completed) << "nothing is waited for when it had ended";
}

TEST(Run, ForeignJobsOnTheMachineAreAFailure) {
    EXPECT_EQ(decide(kRun, machine(6, JobOutcome::running)).kind, Kind::failed);
}

TEST(Machine, IsReadyOnlyWhenIdleAliveAndAnswering) {
    EXPECT_TRUE(is_ready(machine(4, JobOutcome::completed)));
    EXPECT_FALSE(is_ready(MachineView{}));
    EXPECT_FALSE(is_ready(machine(4, JobOutcome::running)));
    for (const MachineState state : {MachineState::starting, MachineState::paused, MachineState::faulted}) {
        MachineView view = machine(4, JobOutcome::completed);
        view.job.state = state;
        EXPECT_FALSE(is_ready(view));
    }
    MachineView silent = machine(4, JobOutcome::completed);
    silent.responding = false;
    EXPECT_FALSE(is_ready(silent));
    EXPECT_FALSE(is_ready(machine(~std::uint64_t{0}, JobOutcome::completed))) << "the next number would be 0";
}

TEST(Machine, DamagedFieldsBecomeSafeOnes) {
    printer::link::JobStatus status;
    std::memset(static_cast<void*>(&status), 0xEE, sizeof status);
    const printer::link::JobStatus read = checked(status);
    EXPECT_EQ(read.state, MachineState::faulted);
    EXPECT_EQ(read.outcome, JobOutcome::running);
    EXPECT_TRUE(read.homed[0]);
    EXPECT_EQ(read.message.size(), read.message.kCapacity);

    printer::link::HeatStatus heat;
    std::memset(static_cast<void*>(&heat), 0xEE, sizeof heat);
    EXPECT_TRUE(checked(heat).bed.fault);
    printer::link::MotionStatus motion;
    std::memset(static_cast<void*>(&motion), 0xEE, sizeof motion);
    EXPECT_TRUE(checked(motion).moving);
}

}  // namespace
}  // namespace qduino::spool::run_test
