// The machine as a whole, without a simulator: who may ask for what when, and what follows from it.
#include "printer/machine/machine.h"

#include <gtest/gtest.h>

#include "tests/unit/machine/fake_loops.h"

namespace qduino::printer::machine::machine_test {
namespace {

using link::Command;
using link::JobOutcome;

/// Longer than loop 1 solves ahead, so that it is not over at once: some 14 s.
constexpr std::string_view kLong = "G1 X100 F600\nG4 S10\nG1 X10 F600\n";

TEST(Machine, AJobRunsFromIdleToIdle) {
    MachineBench bench;
    bench.run();
    EXPECT_EQ(bench.status().state, State::idle);
    bench.job("G28\nG1 X10 F3000\nM106 S255\n");
    ASSERT_TRUE(bench.reaches(State::printing));
    ASSERT_TRUE(bench.reaches(State::idle));
    EXPECT_EQ(bench.status().outcome, JobOutcome::completed);
    EXPECT_EQ(bench.status().bytes_executed, bench.status().job_length);
    EXPECT_EQ(bench.loop2->steps()[0], -100 + 800);
    EXPECT_EQ(bench.status().homed, (std::array{true, true, true}));
    EXPECT_EQ(bench.heat().fan_duty, 1);
}

TEST(Machine, HomingOneAxisLeavesTheOthersWhereTheyWereAskedToBe) {
    MachineBench bench;
    bench.run();
    bench.job("G28\nG1 X46.282 Y63.406 F7200\nG28 X0\n");
    ASSERT_TRUE(bench.reaches(State::printing));
    ASSERT_TRUE(bench.reaches(State::idle));
    EXPECT_EQ(bench.status().position_mm[0], 0);
    EXPECT_EQ(bench.status().position_mm[1], 63.406) << "not the step nearest to it";
}

TEST(Machine, WhatIsAskedForAtTheWrongTimeIsRefusedWithWords) {
    MachineBench bench;
    bench.run();
    EXPECT_EQ(bench.answer(Command::pause), "pause was not taken: nothing is printing\n");
    EXPECT_EQ(bench.answer(Command::resume), "resume was not taken: nothing is paused\n");
    EXPECT_EQ(bench.answer(Command::cancel), "cancel was not taken: nothing is printing\n");
    EXPECT_EQ(bench.answer(Command::clear_fault), "clear fault was not taken: there is no fault\n");
    EXPECT_EQ(bench.status().state, State::idle);
    bench.link->emergency.fetch_add(1);
    bench.run(3);
    EXPECT_EQ(bench.answer(Command::pause), "pause was not taken: the machine has a fault; clear it first\n");
    EXPECT_EQ(bench.answer(Command::cancel),
              "cancel was not taken: the machine has a fault; clear it first\n");
    EXPECT_EQ(bench.answer(Command::resume),
              "resume was not taken: the machine has a fault; clear it first\n");
    EXPECT_EQ(bench.status().state, State::faulted);
}

TEST(Machine, AskingForWhatIsSoAlreadyChangesNothingAndSaysNothing) {
    MachineBench bench;
    bench.job(kLong, 1, false);
    ASSERT_TRUE(bench.reaches(State::printing));
    EXPECT_EQ(bench.answer(Command::resume), "");
    EXPECT_EQ(bench.status().state, State::printing);
    bench.command(Command::pause);
    ASSERT_TRUE(bench.reaches(State::paused));
    EXPECT_EQ(bench.answer(Command::pause), "");
    EXPECT_EQ(bench.status().state, State::paused);
}

TEST(Machine, PauseAndResume) {
    MachineBench bench;
    bench.job("G28\n" + std::string(kLong));
    ASSERT_TRUE(bench.run_until([&] { return bench.status().line >= 2; }));
    bench.command(Command::pause);
    ASSERT_TRUE(bench.reaches(State::paused));
    EXPECT_TRUE(bench.status().parked);
    EXPECT_TRUE(bench.status().may_jog);
    bench.command(Command::resume);
    ASSERT_TRUE(bench.reaches(State::idle));
    EXPECT_EQ(bench.status().outcome, JobOutcome::completed);
    EXPECT_EQ(bench.status().excursions, 1u);
    EXPECT_EQ(bench.loop2->steps()[0], -100 + 800);
}

/// So many short moves that none of those in the planner has a final speed.
TEST(Machine, VeryShortMovesGoOn) {
    MachineBench bench;
    std::string moves = "G28\nM204 S50\nG91\nG1 F7200\n";
    for (int i = 0; i < 2000; ++i) moves += "G1X.01\n";
    bench.job(moves);
    ASSERT_TRUE(bench.reaches(State::printing));
    ASSERT_TRUE(bench.reaches(State::idle));
    EXPECT_EQ(bench.status().outcome, JobOutcome::completed);
    EXPECT_EQ(bench.loop2->steps()[0], -100 + 1600);
}

TEST(Machine, MotorsThatNobodyMovesForAsLongAsM84SSaysGoOff) {
    MachineBench bench;
    bench.run();
    bench.command(Command::gcode, "M84 S5");
    bench.command(Command::gcode, "G28");
    ASSERT_TRUE(bench.run_until([&] { return bench.status().homed[2] && !bench.loop2->moves(); }));
    bench.run(40);
    EXPECT_TRUE(bench.status().homed[0]);
    bench.command(Command::gcode, "G1 X10 F6000");
    bench.run(45);
    EXPECT_TRUE(bench.status().homed[0]) << "it was moved meanwhile";
    bench.motors.log.clear();
    bench.run(20);
    EXPECT_EQ(bench.motors.log, "X-Y-Z-E-");
    EXPECT_EQ(bench.status().homed, (std::array{false, false, false}));
    bench.job("G28\nG4 S20\nG1 X10 F6000\n");
    ASSERT_TRUE(bench.reaches(State::printing));
    ASSERT_TRUE(bench.reaches(State::idle));
    EXPECT_TRUE(bench.status().homed[0]) << "not while a job runs";
}

TEST(Machine, AResumeOnTheWayToTheParkPlaceIsPutOffNotLost) {
    MachineBench bench;
    bench.job("G28\nM0\nG1 X20 F3000\n");
    const auto leaves = [&] { return bench.status().state == State::pausing && bench.loop2->steps()[2] > 0; };
    ASSERT_TRUE(bench.run_until(leaves)) << "up first, before anything moves sideways";
    EXPECT_EQ(bench.answer(Command::resume), "");
    ASSERT_TRUE(bench.reaches(State::idle));
    EXPECT_EQ(bench.status().outcome, JobOutcome::completed);
}

TEST(Machine, StepsThatAreMissingOnTheWayBackStopThePrint) {
    MachineBench bench;
    bench.job("G28\n" + std::string(kLong));
    ASSERT_TRUE(bench.run_until([&] { return bench.status().line >= 2; }));
    bench.command(Command::pause);
    ASSERT_TRUE(bench.reaches(State::paused));
    bench.loop2->slip(Axis::y, 3);
    bench.command(Command::resume);
    ASSERT_TRUE(bench.reaches(State::faulted));
    EXPECT_EQ(bench.status().fault.view(),
              "Y came back from the pause 3 steps beside where it left: the print is stopped");
}

TEST(Machine, CancelEndsTheJobAndForgetsWhatWasTyped) {
    MachineBench bench;
    bench.job("M106 S255\n" + std::string(kLong), 1, false);
    ASSERT_TRUE(bench.run_until([&] { return bench.heat().fan_duty == 1; }));
    bench.command(Command::cancel);
    bench.run();
    bench.command(Command::cancel);
    ASSERT_TRUE(bench.reaches(State::idle));
    EXPECT_EQ(bench.status().outcome, JobOutcome::cancelled);
    EXPECT_EQ(bench.status().fault.view(), "cancelled");
    bench.run(2);
    EXPECT_EQ(bench.heat().fan_duty, 0);
}

TEST(Machine, CancelEndsAHomingThatSomebodyTyped) {
    MachineBench bench;
    for (const Axis axis : gcode::kToolAxes) bench.loop2->put_switch(axis, -1'000'000);
    bench.command(Command::gcode, "G28");
    bench.run(2);
    bench.command(Command::cancel);
    bench.run();
    EXPECT_EQ(bench.status().state, State::cancelling);
    ASSERT_TRUE(bench.reaches(State::idle));
    EXPECT_EQ(bench.status().outcome, JobOutcome::none);
    EXPECT_FALSE(bench.status().homed[0]);
}

TEST(Machine, ABadLineFailsTheJobAndNamesItself) {
    MachineBench bench;
    bench.job("G1 X10 F3000\nG1 X999\n");
    ASSERT_TRUE(bench.run_until([&] { return bench.status().outcome == JobOutcome::failed; }));
    EXPECT_EQ(bench.status().state, State::idle);
    EXPECT_TRUE(bench.status().fault.view().starts_with("line 2, G1: X would go to 999 mm"));
    EXPECT_EQ(bench.loop2->steps()[0], 800);
}

TEST(Machine, AnEmergencyStopFaultsAndIsClearedByAPerson) {
    MachineBench bench;
    bench.job(kLong, 1, false);
    ASSERT_TRUE(bench.reaches(State::printing));
    bench.link->emergency.fetch_add(1);
    bench.run();
    EXPECT_EQ(bench.status().state, State::faulted);
    EXPECT_EQ(bench.status().outcome, JobOutcome::failed);
    EXPECT_EQ(bench.answer(Command::gcode, "G28"),
              "G28 was not done: the machine has a fault; clear it first\n");
    EXPECT_EQ(bench.answer(Command::clear_fault), "fault cleared: home the axes before the next move\n");
    EXPECT_EQ(bench.status().state, State::idle);
    EXPECT_TRUE(bench.status().fault.empty());
}

TEST(Machine, AFaultIsNotClearedWhileTheMotorsAreStillBeingStopped) {
    MachineBench bench;
    bench.run();
    bench.link->emergency.fetch_add(1);
    bench.machine->plan(bench.now += 100ms);  // and loop 2 has not answered
    bench.command(Command::clear_fault);
    bench.machine->plan(bench.now += 100ms);
    EXPECT_EQ(bench.status().state, State::faulted);
    bench.run(3);
    EXPECT_NE(bench.replies.find("the motors are still being stopped"), std::string::npos) << bench.replies;
    bench.command(Command::clear_fault);
    bench.run();
    EXPECT_EQ(bench.status().state, State::idle);
}

TEST(Machine, AFaultThatPersistsIsNotCleared) {
    MachineBench bench;
    bench.run();
    bench.thermistor_open = true;
    ASSERT_TRUE(bench.reaches(State::faulted));
    bench.run(3);
    EXPECT_NE(bench.answer(Command::clear_fault).find("the fault is still there: hot end sensor"),
              std::string::npos);
    bench.thermistor_open = false;
    bench.run(3);
    EXPECT_EQ(bench.answer(Command::clear_fault), "fault cleared: home the axes before the next move\n");
}

TEST(Machine, ASilentLoop3IsAFault) {
    MachineBench bench;
    bench.run(2);
    bench.heat_samples = false;
    ASSERT_TRUE(bench.reaches(State::faulted));
    EXPECT_TRUE(bench.machine->heat_silent());
    EXPECT_NE(bench.status().fault.view().find("loop 3"), std::string_view::npos);
}

TEST(Machine, AJobThatArrivesWhileFaultedIsRefused) {
    MachineBench bench;
    bench.run();
    bench.link->emergency.fetch_add(1);
    bench.run(2);
    bench.job("G1 X10 F3000\n", 9);
    bench.run();
    EXPECT_EQ(bench.status().state, State::faulted);
    EXPECT_EQ(bench.status().job_id, 9u);
    EXPECT_EQ(bench.status().outcome, JobOutcome::failed);
    EXPECT_EQ(bench.status().fault.view(), "emergency stop") << "the fault stays the fault";
}

TEST(Machine, AnM84ThatWasReadButNotDoneUnhomesNothing) {
    MachineBench bench;
    bench.job("G28\n" + std::string(kLong) + "M84\n");
    ASSERT_TRUE(bench.run_until([&] { return bench.status().line >= 2; }));
    bench.command(Command::cancel);
    ASSERT_TRUE(bench.reaches(State::idle));
    EXPECT_TRUE(bench.status().homed[0]);
    bench.replies.clear();
    bench.command(Command::gcode, "G1 X1 F600");
    bench.run();
    EXPECT_EQ(bench.replies, "ok\n") << "and no warning that X was not homed";
}

TEST(Machine, MotorsThatAreSwitchedOffAreNoLongerHomed) {
    MachineBench bench;
    bench.job("G28\nM84 X\n");
    ASSERT_TRUE(bench.run_until([&] { return bench.status().outcome == JobOutcome::completed; }));
    EXPECT_EQ(bench.status().homed, (std::array{false, true, true}));
    EXPECT_TRUE(bench.motors.log.ends_with("X-"));
}

TEST(Machine, AMoveBehindAnM84FindsItsMotorOn) {
    for (const std::string middle : {"M84 X\n", "M84\n", "M84 X\nG4 P10\n", "M84 X\nM84 E\n"}) {
        MachineBench bench;
        bench.job("G28\nG1 X50 F600\n" + middle + "G1 X60 F600\n");
        ASSERT_TRUE(bench.run_until([&] { return bench.status().outcome == JobOutcome::completed; }));
        EXPECT_EQ(bench.loop2->steps()[0], -100 + 60 * 80);
        const std::size_t off = bench.motors.log.rfind("X-");
        ASSERT_NE(off, std::string::npos);
        EXPECT_NE(bench.motors.log.find("X+", off), std::string::npos) << middle << bench.motors.log;
    }
}

TEST(Machine, AJobWithLostHeatPausesAndHeatsUpBeforeItGoesOn) {
    MachineConfig config;
    config.idle_timeout = Seconds{2};
    MachineBench bench(config);
    bench.job("G28\nM109 S200\nG4 S90\nG1 X20 E1 F600\nM104 S0\n");
    ASSERT_TRUE(bench.reaches(State::paused));
    EXPECT_EQ(bench.heat().hot_end.target_celsius, 0);
    bench.command(Command::resume);
    bench.run(2);
    EXPECT_EQ(bench.status().state, State::printing);
    EXPECT_EQ(bench.heat().hot_end.target_celsius, 200);
    ASSERT_TRUE(bench.reaches(State::idle));
    EXPECT_EQ(bench.status().outcome, JobOutcome::completed) << bench.status().fault.view();
}

TEST(Machine, APauseWhileItHeatsUpAgainStaysParked) {
    MachineBench bench;
    bench.job("G28\nM109 S200\nM0\nG1 X20 E1 F600\n");
    ASSERT_TRUE(bench.reaches(State::paused));
    bench.command(Command::gcode, "M104 S0");
    bench.run(50);
    bench.command(Command::resume);
    bench.run();
    EXPECT_EQ(bench.status().state, State::printing);
    bench.command(Command::pause);
    bench.run();
    EXPECT_EQ(bench.status().state, State::paused);
    EXPECT_TRUE(bench.status().may_jog);
}

// ---- filtered motion ----------------------------------------------------------------------------

MachineConfig filtered() {
    MachineConfig config;
    config.axes[Axis::x].shaper = {ShaperType::mzv, 40, 0.1};
    config.axes[Axis::y].shaper = {ShaperType::two_hump_ei, 40, 0.1};
    config.pressure_advance.advance = Seconds{0.05};
    config.jerk_mm_s3 = 100'000;
    return config;
}

// Whatever comes in between, the filters have run out where the machine says that it stands.
TEST(Machine, AShapedMotionPausesParksAndComesBackToTheStep) {
    MachineBench bench{filtered()};
    std::string job = "G28\n";
    for (int i = 1; i <= 12; ++i) write(job, "G1 X", i % 2 * 40 + 10, " Y", i * 7, " F600\n");
    job += "G1 X10\n";
    bench.job(job);
    for (std::uint32_t pause = 1; pause <= 3; ++pause) {
        const std::uint64_t line = 3 * pause;
        ASSERT_TRUE(bench.run_until([&] { return bench.status().line >= line; }));
        bench.command(Command::pause);
        ASSERT_TRUE(bench.reaches(State::paused));
        EXPECT_TRUE(bench.status().parked);
        bench.command(Command::resume);
        ASSERT_TRUE(bench.reaches(State::printing)) << bench.status().fault.view();
    }
    ASSERT_TRUE(bench.reaches(State::idle));
    EXPECT_EQ(bench.status().outcome, JobOutcome::completed);
    EXPECT_EQ(bench.status().excursions, 3u);
    EXPECT_EQ(bench.loop2->steps()[0], -100 + 800);
}

TEST(Machine, WordsChangeTheFiltersAtTheirPlaceAndACancelForgetsNone) {
    MachineBench bench;
    std::string job = "G28\nM593 F40\nG1 X20 F3000\nM900 K0.05\nM593 X F0\n";
    bench.job(job + "G1 X10 Y10\nSET_INPUT_SHAPER SHAPER_TYPE=ei SHAPER_FREQ_X=60\nG1 X5 Y5\n");
    ASSERT_TRUE(bench.reaches(State::idle));
    EXPECT_EQ(bench.status().outcome, JobOutcome::completed);
    EXPECT_EQ(bench.loop2->steps()[0], -100 + 400);
    EXPECT_EQ(bench.loop2->steps()[1], -100 + 400);
    // A change that is cancelled while it waits in the planner is in force for the next job.
    bench.job("G1 X20 F60\nM593 F0\nG1 X0\n", 2);
    ASSERT_TRUE(bench.run_until([&] { return bench.loop2->steps()[0] > 400; }));
    bench.command(Command::cancel);
    ASSERT_TRUE(bench.reaches(State::idle));
    bench.job("G28\nG1 X30 Y30 F3000\n", 3);
    bench.run(2);
    ASSERT_TRUE(bench.reaches(State::idle));
    EXPECT_EQ(bench.status().outcome, JobOutcome::completed);
    EXPECT_EQ(bench.loop2->steps()[0], -100 + 2400);
}

TEST(Machine, AnEmergencyStopInAShapedMotionKnowsWhereTheMachineStands) {
    MachineBench bench{filtered()};
    bench.job("G28\n" + std::string(kLong));
    ASSERT_TRUE(bench.run_until([&] { return bench.status().line >= 3; }));
    bench.link->emergency.fetch_add(1);
    bench.run(3);
    ASSERT_EQ(bench.status().state, State::faulted);
    bench.command(Command::clear_fault);
    ASSERT_TRUE(bench.reaches(State::idle));
    bench.job("G28\nG1 X10 Y10 F3000\n", 2);
    bench.run(2);
    ASSERT_TRUE(bench.reaches(State::idle));
    EXPECT_EQ(bench.status().outcome, JobOutcome::completed);
    EXPECT_EQ(bench.loop2->steps()[0], -100 + 800);
    EXPECT_EQ(bench.loop2->steps()[1], -100 + 800);
}

}  // namespace
}  // namespace qduino::printer::machine::machine_test
