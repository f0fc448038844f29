// Heat control against a small plant of its own: it reaches and holds its target, and each fault
// latches and cuts.
#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "printer/heat/heat_control.h"

namespace qduino::printer::heat::heat_test {
namespace {

/// A hot end as a heated mass: C·dT/dt = P·duty − G·(T − ambient); 40 W settle at about 330 °C.
struct Plant {
    double celsius = 20, watts = 40, heat_capacity = 12, loss = 0.13;
    double read_offset = 0;
    void advance(double duty, double dt) {
        celsius += (watts * duty - loss * (celsius - 20)) / heat_capacity * dt;
    }
    /// As a 12-bit converter shows it near 200 °C: steps of 0.3 °C.
    [[nodiscard]] Celsius reading() const { return Celsius{std::round((celsius + read_offset) / 0.3) * 0.3}; }
};

/// By PID: the plant is not the reference machine's, so its model says nothing of it.
MachineConfig by_pid() {
    MachineConfig config;
    config.hot_end.control = config.bed.control = HeaterControl::pid;
    return config;
}

struct Bench {
    MachineConfig config = by_pid();
    channel::FourSlot<link::HeatStatus> service;
    HeatControl control{config, service};
    Plant hot_end;
    Instant now{};
    HeatDuties duties;
    bool cut = false;
    bool silent = false;

    void run(double seconds) {
        for (int i = 0; i < static_cast<int>(seconds / 0.008); ++i) {
            HeatReadings readings{hot_end.reading(), Celsius{22}};
            if (silent) readings.hot_end.reset();
            duties = control.sample(now, readings, cut);
            hot_end.advance(duties.hot_end, 0.008);
            now += 8ms;
        }
    }
    void target(double celsius, std::uint32_t clear = 0) {
        HeatTargets targets;
        targets.hot_end = Celsius{celsius};
        targets.clear_faults = clear;
        control.set_targets(targets);
    }
    [[nodiscard]] std::string_view fault() {
        text = control.status().fault;
        return text.view();
    }
    FixedString<160> text;
};

TEST(Heat, ReachesAndHoldsItsTarget) {
    Bench bench;
    bench.target(209);
    bench.run(240);
    for (int i = 0; i < 60; ++i) {
        bench.run(1);
        ASSERT_NEAR(bench.hot_end.celsius, 209, 2.0) << "second " << i;
    }
    EXPECT_EQ(bench.fault(), "");
}

TEST(Heat, OvershootStaysWithinTheFunctionalRange) {
    Bench bench;
    bench.target(209);
    double peak = 0;
    for (int i = 0; i < 400; ++i) {
        bench.run(1);
        peak = std::max(peak, bench.hot_end.celsius);
    }
    EXPECT_GT(peak, 208);
    EXPECT_LT(peak, 219);
}

TEST(Pid, ALoadThatFullPowerCannotCarryDoesNotWindItUp) {
    Pid pid{{.kp = 22.2, .ki = 1.08, .kd = 114}};
    double duty = 0;
    const auto run = [&](double celsius, double seconds) {
        for (double at = 0; at < seconds; at += 0.008) duty = pid.update(200, celsius, 0.008);
    };
    run(193, 300);
    EXPECT_EQ(duty, 1.0);
    run(200, 30);  // the load is gone: what is left is the integral
    EXPECT_LT(duty, 0.5);
    EXPECT_GT(duty, 0.2);
}

TEST(Heat, OffMeansNoPower) {
    Bench bench;
    bench.target(0);
    bench.run(1);
    EXPECT_EQ(bench.duties.hot_end, 0.0);
    EXPECT_EQ(bench.duties.bed, 0.0);
}

TEST(Heat, EmergencyCutsPowerAtTheNextSample) {
    Bench bench;
    bench.target(209);
    bench.run(5);
    ASSERT_EQ(bench.duties.hot_end, 1.0);
    bench.cut = true;
    bench.run(0.008);
    EXPECT_EQ(bench.duties.hot_end, 0.0);
}

TEST(Heat, SilentSensorFaultsAfterFourSamplesAndNotAfterThree) {
    Bench bench;
    bench.target(209);
    bench.run(5);
    bench.silent = true;
    bench.run(3 * 0.008 + 0.001);
    EXPECT_EQ(bench.fault(), "");
    EXPECT_EQ(bench.duties.hot_end, 0.0) << "no reading, no heat";
    bench.run(0.009);
    EXPECT_NE(bench.fault().find("hot end sensor does not answer"), std::string_view::npos);
}

TEST(Heat, ReadingOutOfRangeFaultsAndLatches) {
    for (double offset : {-300.0, 300.0}) {
        Bench bench;
        bench.target(209);
        bench.run(1);
        bench.hot_end.read_offset = offset;
        bench.run(0.1);
        EXPECT_NE(bench.fault().find("outside its range"), std::string_view::npos) << offset;
        bench.hot_end.read_offset = 0;
        bench.run(10);
        EXPECT_EQ(bench.duties.hot_end, 0.0) << "a fault stays until it is cleared";
    }
}

TEST(Heat, StuckThermistorIsFoundWhileHeatingUp) {
    Bench bench;
    bench.hot_end.watts = 0;  // the reading does not move
    bench.target(209);
    bench.run(19);
    EXPECT_EQ(bench.fault(), "");
    bench.run(3);
    EXPECT_NE(bench.fault().find("does not heat up"), std::string_view::npos) << bench.fault();
}

TEST(Heat, FallingAwayFromTheTargetIsFound) {
    Bench bench;
    bench.target(209);
    bench.run(300);
    ASSERT_EQ(bench.fault(), "");
    bench.hot_end.watts = 3;  // the cartridge has nearly come out
    bench.run(120);
    EXPECT_NE(bench.fault().find("lost its temperature"), std::string_view::npos) << bench.fault();
}

/// A job that asks for another degree every five seconds gets no more time than any other.
TEST(Heat, TargetsThatChangeByStepsDoNotPutTheFaultOff) {
    for (const bool was_hot : {false, true}) {
        Bench bench;
        bench.target(209);
        if (was_hot) bench.run(300);
        ASSERT_EQ(bench.fault(), "");
        bench.hot_end.watts = 0;
        double until_fault_s = 0;
        for (int step = 0; bench.fault().empty() && step < 60; ++step, until_fault_s += 5) {
            bench.target(209 + step % 2);
            bench.run(5);
        }
        EXPECT_LE(until_fault_s, was_hot ? 45 : 25) << was_hot;
        EXPECT_NE(bench.fault().find("heat"), std::string_view::npos) << bench.fault();
    }
}

TEST(Heat, TargetsThatChangeByStepsAreNoFault) {
    Bench bench;
    for (int step = 0; step < 100; ++step) {
        bench.target(150 + step % 2 + step / 2);
        bench.run(step == 0 ? 15 : 3);
        ASSERT_EQ(bench.fault(), "") << step;
    }
}

/// A wire that touches once a second shows the right temperature for a moment.
TEST(Heat, AReadingThatIsRightNowAndThenIsFound) {
    Bench bench;
    bench.target(209);
    bench.run(300);
    ASSERT_EQ(bench.fault(), "");
    for (int second = 0; second < 60 && bench.fault().empty(); ++second) {
        bench.hot_end.read_offset = -40;
        bench.run(0.9);
        bench.hot_end.read_offset = 0;
        bench.run(0.1);
    }
    EXPECT_NE(bench.fault().find("lost its temperature"), std::string_view::npos) << bench.fault();
}

TEST(Heat, ADeadSensorIsNoReadingAndPersists) {
    Bench bench;
    bench.target(209);
    bench.run(30);
    const double last = bench.hot_end.reading().value();
    EXPECT_TRUE(bench.control.status().hot_end.reading);
    bench.silent = true;
    bench.run(0.5);
    EXPECT_FALSE(bench.control.status().hot_end.reading);
    EXPECT_TRUE(bench.control.status().bed.reading);
    EXPECT_NEAR(bench.control.status().hot_end.celsius, last, 1) << "the last one stays";
    EXPECT_NE(bench.control.status().persists.view().find("hot end sensor does not answer"),
              std::string_view::npos);
    bench.silent = false;
    bench.run(0.5);
    EXPECT_TRUE(bench.control.status().persists.view().empty()) << "latched, but it may be cleared";
    EXPECT_NE(bench.fault(), "");
}

TEST(Heat, UnusedHeatIsCutWithoutLoop1) {
    Bench bench;
    bench.target(209);
    bench.run(100 + 610);
    EXPECT_TRUE(bench.control.status().idle_timed_out);
    EXPECT_EQ(bench.duties.hot_end, 0.0);
    EXPECT_EQ(bench.control.status().hot_end.target_celsius, 0) << "whatever is still asked";
    bench.run(300);
    EXPECT_LT(bench.hot_end.celsius, 60);
    EXPECT_EQ(bench.fault(), "");
}

TEST(Heat, SwitchStuckOnIsFound) {
    Bench bench;
    bench.target(0);
    bench.run(1);
    for (int i = 0; i < 200 && bench.fault().empty(); ++i) {
        bench.run(1);
        bench.hot_end.advance(1.0, 1.0);  // power that nobody asked for
    }
    EXPECT_NE(bench.fault().find("far above what was asked"), std::string_view::npos) << bench.fault();
}

TEST(Heat, CoolingDownFromAPrintIsNoFault) {
    Bench bench;
    bench.target(209);
    bench.run(300);
    bench.target(0);
    bench.run(600);
    EXPECT_EQ(bench.fault(), "");
}

TEST(Heat, ClearingAFaultNeedsANewNumber) {
    Bench bench;
    bench.target(209);
    bench.silent = true;
    bench.run(0.1);
    ASSERT_NE(bench.fault(), "");
    bench.silent = false;
    bench.target(209, 0);
    bench.run(0.1);
    EXPECT_NE(bench.fault(), "");
    bench.target(209, 1);
    bench.run(0.1);
    EXPECT_EQ(bench.fault(), "");
    EXPECT_EQ(bench.duties.hot_end, 1.0);
}

TEST(Heat, OneFaultyHeaterCutsBoth) {
    Bench bench;
    HeatTargets targets;
    targets.hot_end = Celsius{209};
    targets.bed = Celsius{60};
    bench.control.set_targets(targets);
    bench.run(1);
    ASSERT_GT(bench.duties.bed, 0.0);
    bench.silent = true;
    bench.run(0.1);
    EXPECT_EQ(bench.duties.bed, 0.0);
}

TEST(Heat, LoopOneAndTheServiceReadTheSameSample) {
    Bench bench;
    bench.target(209);
    bench.run(10);
    const link::HeatStatus loop_1 = bench.control.status();
    const link::HeatStatus service = bench.service.read();
    EXPECT_EQ(service.heartbeat, loop_1.heartbeat);
    EXPECT_EQ(service.hot_end.celsius, loop_1.hot_end.celsius);
    EXPECT_EQ(service.hot_end.target_celsius, 209.0);
}

}  // namespace
}  // namespace qduino::printer::heat::heat_test
