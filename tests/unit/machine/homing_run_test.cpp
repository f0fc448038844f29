#include "printer/machine/homing_run.h"

#include <gtest/gtest.h>

#include "tests/unit/gcode/recorder.h"
#include "tests/unit/machine/fake_loops.h"

namespace qduino::printer::machine::homing_run_test {
namespace {

/// Homing on a pipe whose steps are played at once.
struct Bench {
    std::atomic<std::uint32_t> emergency{0};
    MachineConfig config;
    std::unique_ptr<MotionPipe> pipe = std::make_unique<MotionPipe>(config, emergency);
    NotedMotors pins;
    Motors motors{Kinematics{config}, pins};
    HomingRun homing{config, *pipe, motors};
    FakeLoop2 loop2{*pipe};
    Instant now = instant_from_ns(0);
    int settled = 0;
    std::string error;
    int releases = 0;
    int emergency_in = -1;  // the release in whose middle the service's stop comes

    /// What loop 1 does in one release, as far as homing is concerned.
    void release(bool may_start = true) {
        now += 100ms;
        pipe->observe();
        if (releases++ == emergency_in) ++emergency;
        if (pipe->stops().running() && !pipe->stopping()) {
            pipe->reset(pipe->scale().position_of(pipe->seen().steps));
            const Result<void> done = homing.stopped();
            if (!done.ok()) error = done.error().message.view();
        }
        const Result<bool> done = homing.advance(now, may_start && pipe->drained());
        if (!done.ok()) {
            error = done.error().message.view();
        } else if (*done) {
            ++settled;
        }
        pipe->pump(false);
        loop2.play();
    }
    void run() {
        for (int i = 0; i < 2000 && homing.active(); ++i) release();
    }
};

// Each release decides by one view of the stops: a motion that was at rest when it began may be
// reset in it. The emergency stop itself is the machine's to answer, in the next release.
TEST(HomingRun, AnEmergencyStopInTheMiddleOfAnyReleaseBreaksNoContract) {
    for (int release = 0;; ++release) {
        Bench bench;
        bench.emergency_in = release;
        bench.loop2.put_switch(Axis::x, -400);
        bench.homing.begin(gcode::AxisSet{}.add(Axis::x));
        while (bench.homing.active() && bench.releases < release + 5) bench.release();
        if (!bench.homing.active() && bench.releases <= release) break;  // it ended before
        ASSERT_LT(release, 1000);
    }
}

TEST(HomingRun, AnAxisIsHomeWhereItsSwitchPresses) {
    Bench bench;
    bench.loop2.put_switch(Axis::x, -400);
    bench.homing.begin(gcode::AxisSet{}.add(Axis::x));
    bench.run();
    EXPECT_EQ(bench.error, "");
    EXPECT_TRUE(bench.homing.homed(Axis::x));
    EXPECT_FALSE(bench.homing.homed(Axis::y));
    EXPECT_EQ(bench.settled, 1);
    EXPECT_EQ(bench.loop2.steps()[0], -400);
    EXPECT_EQ(bench.pipe->scale().origin()[0], -400);
    EXPECT_EQ(bench.pipe->planner().position_mm()[0], 0);
    EXPECT_EQ(bench.pins.log, "X+X+X+") << "before each of its three moves";
}

TEST(HomingRun, ItBeginsWhenEverythingBeforeHasBeenPlayed) {
    Bench bench;
    bench.loop2.put_switch(Axis::x, -400);
    bench.homing.begin(gcode::AxisSet{}.add(Axis::x));
    for (int i = 0; i < 5; ++i) bench.release(false);
    EXPECT_EQ(bench.loop2.steps()[0], 0);
    bench.run();
    EXPECT_TRUE(bench.homing.homed(Axis::x));
}

TEST(HomingRun, AnAxisThatIsHomedAgainIsNotHomedMeanwhile) {
    Bench bench;
    for (const Axis axis : gcode::kToolAxes) bench.loop2.put_switch(axis, -100);
    bench.homing.begin(gcode::AxisSet::tool());
    bench.run();
    ASSERT_TRUE(bench.homing.all_homed());
    bench.homing.begin(gcode::AxisSet{}.add(Axis::y));
    EXPECT_TRUE(bench.homing.homed(Axis::x));
    EXPECT_FALSE(bench.homing.homed(Axis::y));
    bench.run();
    EXPECT_TRUE(bench.homing.all_homed());
}

TEST(HomingRun, ASwitchThatIsNeverReachedFailsAndNamesIt) {
    Bench bench;
    bench.loop2.put_switch(Axis::x, -100);
    bench.homing.begin(gcode::AxisSet{}.add(Axis::x).add(Axis::y));
    bench.run();
    EXPECT_EQ(bench.error, "Y endstop (pin 9) was not reached: check the switch, its wire and the motor");
    EXPECT_FALSE(bench.homing.active());
    EXPECT_FALSE(bench.homing.homed(Axis::x)) << "nothing is trusted after a homing that failed";
}

TEST(HomingRun, ASwitchThatStaysPressedFailsAtTheSlowApproach) {
    Bench bench;
    bench.loop2.put_switch(Axis::x, 1'000'000);
    bench.homing.begin(gcode::AxisSet{}.add(Axis::x));
    bench.run();
    EXPECT_EQ(
        bench.error,
        "X endstop (pin 5) still reads pressed after moving away from it: check the switch and its wire");
}

TEST(HomingRun, SwitchedOffAxesAreForgottenAndInterpretersAreTold) {
    Bench bench;
    for (const Axis axis : gcode::kToolAxes) bench.loop2.put_switch(axis, -100);
    bench.homing.begin(gcode::AxisSet::tool());
    bench.run();
    bench.homing.forget(gcode::AxisSet{}.add(Axis::z).add(Axis::e));
    gcode::Recorder recorder;
    gcode::Interpreter interpreter(bench.config, recorder);
    bench.homing.tell(interpreter);
    EXPECT_TRUE(interpreter.homed(Axis::x));
    EXPECT_FALSE(interpreter.homed(Axis::z));
    bench.homing.abandon();
    bench.homing.tell(interpreter);
    EXPECT_FALSE(interpreter.homed(Axis::x));
}

TEST(HomingRun, AbandonedItDoesNothingMore) {
    Bench bench;
    bench.homing.begin(gcode::AxisSet::tool());
    bench.release();
    bench.homing.abandon();
    bench.pipe->stops().ask();
    for (int i = 0; i < 10; ++i) bench.release();
    EXPECT_FALSE(bench.homing.active());
    EXPECT_EQ(bench.error, "");
    EXPECT_EQ(bench.settled, 0);
    EXPECT_TRUE(bench.pipe->drained());
}

}  // namespace
}  // namespace qduino::printer::machine::homing_run_test
