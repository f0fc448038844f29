// A pause parks the head beside the part, lets a person work there, and goes on at the very step:
// the twin compares.
#include <gtest/gtest.h>

#include <random>

#include "printer/preflight/preflight.h"
#include "tests/scenario/printer/printer_bench.h"

namespace qduino::tests::park_test {
namespace {

using link::Command;
using link::JobOutcome;
using link::MachineState;

/// Lines, arcs and retractions, hot; relative or absolute as `relative` says. About 60 s of motion.
std::string hot_job(bool relative = false) {
    struct Leg {
        const char* code;
        double dx, dy, de;
    };
    // The arc stays clear of the four points where an axis turns back: there a chord's error shows.
    constexpr std::array kLap{Leg{"G1", 30.37, 0, 1.013},
                              Leg{"G1", 0, 30.11, 1.013},
                              Leg{"G1", -30.37, 0, 1.013},
                              Leg{"G1", 0, -30.11, 1.013},
                              Leg{"G3 I-8 J-6", -2, 2, 0.12},
                              Leg{"G1", 2, -2, 0.12},
                              Leg{"G1", 0, 0, -1},
                              Leg{"G1", 0, 0, 1}};
    std::string text = "G28\nM109 S200\nG92 E0\nG1 X40.013 Y40.007 Z0.3 F6000\n";
    text += relative ? "G91\nM83\nG1 F900\n" : "G90\nM82\nG1 F900\n";
    double x = 40.013, y = 40.007, e = 0;
    for (int lap = 0; lap < 3; ++lap) {
        for (const Leg& leg : kLap) {
            x += leg.dx;
            y += leg.dy;
            e += leg.de;
            char line[96];
            std::snprintf(line, sizeof line, "%s X%.4f Y%.4f E%.4f\n", leg.code, relative ? leg.dx : x,
                          relative ? leg.dy : y, relative ? leg.de : e);
            text += line;
        }
    }
    return text + "M104 S0\nM84\n";  // read long before it is done: the axes are homed until then
}

std::string all_differences(const twin::Report& report) {
    std::string all;
    for (const std::string& difference : report.differences) all += difference + "\n";
    return all;
}

/// A bench in the middle of a job, where line `line` has been done.
class Parked : public testing::Test {
  protected:
    void start(const std::string& job, std::uint64_t line, board::Peripherals* front = nullptr) {
        ASSERT_TRUE(bench.begin(front));
        bench.job(job);
        ASSERT_TRUE(bench.run_until([&] { return bench.status().line >= line; }, 900)) << bench.fault();
    }
    void pause() {
        bench.command(Command::pause);
        ASSERT_TRUE(bench.run_until([&] { return bench.status().state == MachineState::paused; }, 60));
    }
    void type_jog(const std::string& move) {
        for (const std::string& line :
             {std::string{"M83"}, std::string{"G91"}, "G1 " + move, std::string{"G90"}, std::string{"M82"}}) {
            bench.type(line);
        }
        bench.run(0.5);
    }
    void resume_and_match(std::uint32_t excursions = 1) {
        bench.command(Command::resume);
        ASSERT_TRUE(bench.finish_job());
        EXPECT_EQ(bench.status().outcome, JobOutcome::completed) << bench.fault();
        EXPECT_EQ(bench.status().excursions, excursions);
        const twin::Report report = bench.report();
        EXPECT_TRUE(report.matches) << all_differences(report);
        EXPECT_EQ(report.findings.excursions, excursions);
        EXPECT_EQ(report.cold_extrusion_steps, 0u);
    }
    PrinterBench bench;
};

TEST_F(Parked, WithoutAPauseTheJobMatches) {
    for (const bool relative : {false, true}) {
        PrinterBench plain;
        ASSERT_TRUE(plain.begin());
        plain.job(hot_job(relative));
        ASSERT_TRUE(plain.finish_job());
        const twin::Report report = plain.report();
        EXPECT_TRUE(report.matches) << relative << all_differences(report);
        EXPECT_EQ(report.findings.excursions, 0u);
    }
}

class ParkedAt : public Parked, public testing::WithParamInterface<std::uint64_t> {};

TEST_P(ParkedAt, GoesToItsPlaceAndComesBackToTheStep) {
    start(hot_job(), GetParam());
    const double e_before = bench.metal().position_mm[3];
    pause();
    const twin::PrinterState parked = bench.metal();
    EXPECT_NEAR(parked.position_mm[0], 0, 0.0126);
    EXPECT_NEAR(parked.position_mm[1], 150, 0.0126);
    EXPECT_NEAR(parked.position_mm[2], 5.3, 0.0006);
    EXPECT_LT(parked.position_mm[3], e_before + 2) << "drawn back";
    EXPECT_TRUE(bench.status().parked);
    EXPECT_TRUE(bench.status().may_jog);
    bench.run(20);
    EXPECT_EQ(bench.metal().position_steps, parked.position_steps);
    resume_and_match();
}
INSTANTIATE_TEST_SUITE_P(Lines, ParkedAt, testing::Values(7, 8, 11, 13, 17, 21, 25));

TEST_F(Parked, JogsAndAFilamentChangeDoNotShiftThePrint) {
    start(hot_job(), 12);
    pause();
    const std::int64_t e_parked = bench.metal().position_steps[3];
    type_jog("X12.34 F3000");
    type_jog("Y-20 Z3.3 F3000");
    type_jog("E-30 F600");
    type_jog("E42.5 F600");
    bench.run(20);
    const twin::PrinterState jogged = bench.metal();
    EXPECT_NEAR(jogged.position_mm[0], 12.34, 0.0126);
    EXPECT_NEAR(jogged.position_mm[1], 130, 0.0126);
    EXPECT_EQ(jogged.position_steps[3] - e_parked, 1200);
    EXPECT_NEAR(bench.status().position_mm[0], 12.34, 1e-9) << "people see where the head is";
    resume_and_match();
}

TEST_F(Parked, M600DrawsTheFilamentOutAndPushesItInBesideThePart) {
    std::string job = hot_job();
    const std::size_t half = job.find("\nG1", job.size() / 2) + 1;
    job.insert(half, "M600 X20 Y90 Z3 E1.5 U40 L25\n");
    ASSERT_TRUE(bench.begin());
    bench.job(job);
    ASSERT_TRUE(bench.run_until([&] { return bench.status().state == MachineState::paused; }, 900));
    const auto parked = bench.metal().position_mm;
    EXPECT_NEAR(parked[0], 20, 0.02);
    EXPECT_NEAR(parked[1], 90, 0.02);
    EXPECT_NEAR(parked[2], 3.3, 0.002) << "up by Z";
    bench.command(Command::resume);
    double highest = parked[3];
    ASSERT_TRUE(bench.run_until(
        [&] {
            const auto at = bench.metal().position_mm;
            if (std::abs(at[0] - 20) < 0.02 && std::abs(at[1] - 90) < 0.02)
                highest = std::max(highest, at[3]);
            return bench.status().excursions == 1;
        },
        120));
    EXPECT_NEAR(highest - parked[3], 40 + 25, 0.2) << "in again, and the purge, at the park place";
    ASSERT_TRUE(bench.finish_job());
    const twin::Report report = bench.report();
    EXPECT_TRUE(report.matches) << all_differences(report);
}

TEST_F(Parked, M125ParksWhereItSays) {
    std::string job = hot_job();
    job.insert(job.find("\nG1", job.size() / 2) + 1, "M125 X15 Y95 Z1\n");
    ASSERT_TRUE(bench.begin());
    bench.job(job);
    ASSERT_TRUE(bench.run_until([&] { return bench.status().state == MachineState::paused; }, 900));
    EXPECT_NEAR(bench.metal().position_mm[0], 15, 0.02);
    EXPECT_NEAR(bench.metal().position_mm[1], 95, 0.02);
    EXPECT_NEAR(bench.metal().position_mm[2], 1.3, 0.002);
    resume_and_match();
}

TEST_F(Parked, AJogOutsideTheBoundsOrColdIsRefused) {
    start(hot_job(), 9);
    pause();
    const auto before = bench.metal().position_steps;
    type_jog("X-1 F3000");
    type_jog("Z200 F300");
    EXPECT_NE(bench.replies().find("this machine reaches from 0 to 150"), std::string::npos)
        << bench.replies();
    bench.type("G28");
    bench.type("M84");
    bench.run(1);
    EXPECT_NE(bench.replies().find("G28 was not done"), std::string::npos);
    bench.type("M104 S0");
    bench.run(300);
    ASSERT_LT(bench.heat().hot_end.celsius, 150);
    type_jog("E5 F300");
    EXPECT_NE(bench.replies().find("filament moves only from 170"), std::string::npos);
    EXPECT_EQ(bench.metal().position_steps, before);
    resume_and_match();
}

/// Heat that a person takes from a job: its line, and which heater is off then.
class HeatTaken : public Parked, public testing::WithParamInterface<const char*> {
  protected:
    /// Paused, beside the part, and cold by then.
    void expect_pause() {
        ASSERT_TRUE(bench.run_until([&] { return bench.status().state == MachineState::paused; }, 60))
            << bench.fault();
        EXPECT_EQ(bench.status().outcome, JobOutcome::running) << bench.fault();
        EXPECT_TRUE(bench.status().parked);
        EXPECT_NE(bench.replies().find("heats up again first"), std::string::npos) << bench.replies();
        bench.run(300);
    }
};

TEST_P(HeatTaken, PausesTheJobAndResumingHeatsFirst) {
    std::string job = hot_job();
    job.insert(job.find("M109"), "M190 S60\n");
    start(job, 13);
    bench.type(GetParam());
    expect_pause();
    const bool bed = std::string_view{GetParam()}.starts_with("M140");
    EXPECT_LT(bed ? bench.heat().bed.celsius : bench.heat().hot_end.celsius, bed ? 57 : 165);
    bench.command(Command::resume);
    bench.run(2);
    EXPECT_EQ(bench.status().activity, bed ? link::Activity::heating_bed : link::Activity::heating_hot_end);
    EXPECT_EQ(bench.heat().hot_end.target_celsius, 200);
    EXPECT_EQ(bench.heat().bed.target_celsius, 60);
    resume_and_match();
}
INSTANTIATE_TEST_SUITE_P(Lines, HeatTaken, testing::Values("M104 S0", "M140 S0", "M104 S120"));

TEST_F(HeatTaken, WhileTheJobWaitsForHeat) {
    ASSERT_TRUE(bench.begin());
    bench.job(hot_job());
    ASSERT_TRUE(bench.run_until([&] { return bench.status().activity == link::Activity::homing; }, 60));
    ASSERT_TRUE(
        bench.run_until([&] { return bench.status().activity == link::Activity::heating_hot_end; }, 200));
    bench.run(20);
    bench.type("M104 S0");
    expect_pause();
    EXPECT_EQ(bench.heat().hot_end.target_celsius, 0);
    resume_and_match();
}

TEST_F(HeatTaken, OnTheWayToAPauseAndOnTheWayBack) {
    start(hot_job(), 13);
    bench.command(Command::pause);
    bench.run(0.1);
    ASSERT_EQ(bench.status().state, MachineState::pausing);
    bench.type("M104 S0");
    ASSERT_TRUE(bench.run_until([&] { return bench.status().state == MachineState::paused; }, 60));
    bench.run(200);
    bench.command(Command::resume);
    bench.run(2);
    ASSERT_EQ(bench.status().activity, link::Activity::heating_hot_end);
    bench.type("M104 S0");
    expect_pause();
    resume_and_match();
}

TEST_F(Parked, ModesOfTheJobAreNotTouchedByJogs) {
    start(hot_job(true), 12);
    pause();
    type_jog("X3 F3000");
    type_jog("E4 F300");
    bench.type("M220 S150");
    bench.run(1);
    EXPECT_EQ(bench.status().feed_factor, 1.5);
    resume_and_match();
}

TEST_F(Parked, ColdItDrawsNothingBack) {
    start("G28\nG90\nG1 Z1 F300\nG1 X100 Y10 F1200\nG1 X100 Y100\nG1 X10 Y100\n", 4);
    pause();
    EXPECT_EQ(bench.metal().position_mm[3], 0);
    EXPECT_TRUE(bench.status().parked);
    resume_and_match();
}

TEST_F(Parked, UnhomedItStopsWhereItIsAndSaysSo) {
    start("G91\nG1 X30 F600\nG1 Y20\nG1 X-10\n", 2);
    pause();
    const auto at_rest = bench.metal().position_steps;
    EXPECT_FALSE(bench.status().parked);
    EXPECT_TRUE(bench.status().may_jog);
    EXPECT_NE(bench.replies().find("it parks only when all axes have been homed"), std::string::npos);
    type_jog("X1 F600");
    EXPECT_NE(bench.replies().find("home first"), std::string::npos);
    EXPECT_EQ(bench.metal().position_steps, at_rest);
    bench.command(Command::resume);
    ASSERT_TRUE(bench.finish_job());
    EXPECT_TRUE(bench.report().matches);
}

TEST(ParkedOff, ThenAPauseStopsAndJogsStillComeBack) {
    printer::MachineConfig config;
    config.park.enabled = false;
    PrinterBench bench(config);
    ASSERT_TRUE(bench.begin());
    bench.job(hot_job());
    ASSERT_TRUE(bench.run_until([&] { return bench.status().line >= 12; }, 900));
    bench.command(Command::pause);
    ASSERT_TRUE(bench.run_until([&] { return bench.status().state == MachineState::paused; }, 60));
    EXPECT_FALSE(bench.status().parked);
    EXPECT_GT(bench.metal().position_mm[0], 30);
    for (const char* line : {"G91", "M83", "G1 Z10 F300", "G1 X5 F600", "G1 E20 F300"}) bench.type(line);
    bench.run(15);
    bench.command(Command::resume);
    ASSERT_TRUE(bench.finish_job());
    EXPECT_EQ(bench.status().outcome, JobOutcome::completed) << bench.fault();
    const twin::Report report = bench.report();
    EXPECT_TRUE(report.matches) << all_differences(report);
}

TEST_F(Parked, CancelEndsTheJobBesideThePart) {
    start(hot_job(), 12);
    pause();
    type_jog("X5 F600");
    bench.command(Command::cancel);
    ASSERT_TRUE(bench.finish_job(10));
    EXPECT_EQ(bench.status().outcome, JobOutcome::cancelled);
    EXPECT_EQ(bench.status().state, MachineState::idle);
    EXPECT_FALSE(bench.status().parked);
    EXPECT_EQ(bench.heat().hot_end.target_celsius, 0);
    EXPECT_GT(bench.metal().position_mm[2], 5) << "lifted";
    bench.job("G28\nG1 X30 F3000\n", 2);
    ASSERT_TRUE(bench.run_until([&] { return bench.status().job_id == 2; }, 5));
    ASSERT_TRUE(bench.finish_job());
    EXPECT_TRUE(bench.report().findings.path_consumed);
    EXPECT_EQ(bench.status().excursions, 0u);
}

TEST_F(Parked, AnM84ThatWasReadButNotDoneUnhomesNothing) {
    start("G28\nG1 Z1 F300\nG1 X100 F600\nG1 X50\nG1 X100\nM84\n", 2);
    bench.run(1);
    EXPECT_TRUE(bench.status().homed[0]);
    pause();
    EXPECT_TRUE(bench.status().parked);
    bench.command(Command::cancel);
    ASSERT_TRUE(bench.finish_job(10));
    EXPECT_TRUE(bench.status().homed[0]) << "the motors were never off";
    bench.type("M84");
    bench.run(0.5);
    EXPECT_FALSE(bench.status().homed[0]);
}

TEST_F(Parked, CancelAndEmergencyOnTheWayThere) {
    start(hot_job(), 12);
    bench.command(Command::pause);
    bench.run(1.2);
    ASSERT_EQ(bench.status().state, MachineState::pausing);
    bench.command(Command::cancel);
    ASSERT_TRUE(bench.finish_job(15));
    EXPECT_EQ(bench.status().outcome, JobOutcome::cancelled);
    bench.job(hot_job(), 2);
    ASSERT_TRUE(
        bench.run_until([&] { return bench.status().job_id == 2 && bench.status().line >= 12; }, 900));
    pause();
    bench.command(Command::resume);
    bench.run(1);
    bench.emergency();
    bench.run(1);
    const auto at_rest = bench.metal().position_steps;
    EXPECT_EQ(bench.status().state, MachineState::faulted);
    bench.run(5);
    EXPECT_EQ(bench.metal().position_steps, at_rest);
    EXPECT_FALSE(bench.status().parked);
    bench.command(Command::clear_fault);
    bench.run(1);
    EXPECT_EQ(bench.status().state, MachineState::idle);
    EXPECT_GE(bench.status().line, 12u) << "where the failed job stopped is kept";
}

TEST_F(Parked, ResumeOnTheWayThereAndPauseOnTheWayBack) {
    start(hot_job(), 12);
    bench.command(Command::pause);
    bench.run(1.5);
    bench.command(Command::resume);
    ASSERT_TRUE(bench.run_until([&] { return bench.status().state == MachineState::printing; }, 30));
    bench.run(1);
    bench.command(Command::pause);
    ASSERT_TRUE(bench.run_until([&] { return bench.status().state == MachineState::paused; }, 60));
    EXPECT_TRUE(bench.status().parked);
    bench.command(Command::resume);
    ASSERT_TRUE(bench.finish_job());
    const twin::Report report = bench.report();
    EXPECT_TRUE(report.matches) << all_differences(report);
}

TEST_F(Parked, TheTargetThatIsSetWhilePausedIsGoneOnWith) {
    start(hot_job(), 12);
    pause();
    bench.type("M104 S215");
    bench.run(30);
    bench.type("M104 S0");
    bench.run(60);
    bench.command(Command::resume);
    bench.run(2);
    EXPECT_EQ(bench.heat().hot_end.target_celsius, 215);
    ASSERT_TRUE(bench.finish_job());
    EXPECT_TRUE(bench.report().matches);
}

TEST_F(Parked, TheLayerIsTheOneThatIsPrintedNotTheOneThatIsRead) {
    std::string text = "G28\nM109 S200\nM83\nG1 Z1 F300\n";
    for (int layer = 0; layer < 40; ++layer)
        text += ";LAYER:" + std::to_string(layer) + "\nG1 X100 E1 F1200\nG1 X10\n";
    start(text, 10);
    EXPECT_LE(bench.status().layer, 4u);
    EXPECT_GE(bench.status().layer, 1u);
}

TEST_F(Parked, WithoutCommentsLayersAreFoundFromZAsPreflightFindsThem) {
    std::string text = "G28\nM109 S200\nM83\nG1 Z5 F300\n";
    for (int layer = 1; layer <= 12; ++layer) {
        text += "G1 Z" + std::to_string(layer * 0.3) + "\nG1 X30 E1 F3000\nG1 Z8\nG1 X10\n";
    }
    printer::preflight::Preflight preflight{printer::MachineConfig{}};
    preflight.feed({text.data(), text.size()});
    EXPECT_EQ(preflight.finish().layers, 12u);
    start(text, 4 + 4 * 5 + 4);
    EXPECT_EQ(bench.status().layer, 6u);
    ASSERT_TRUE(bench.finish_job());
    EXPECT_EQ(bench.status().layer, 12u);
}

/// Keeps single pulses of X from the motor: the machine believes that it came back, and did not.
class LossyPins final : public board::ForwardingPeripherals {
  public:
    void pin_written(Instant now, board::PinId pin, board::Level level) override {
        if (pin.number == 2 && lose > 0) {
            if (level == board::Level::low) --lose;
            return;
        }
        ForwardingPeripherals::pin_written(now, pin, level);
    }
    int lose = 0;
};

TEST(ParkedAndBack, OneStepBesideIsNoticedFromThePins) {
    LossyPins pins;
    PrinterBench bench;
    pins.forward_to(bench.twin());
    ASSERT_TRUE(bench.begin(&pins));
    bench.job(hot_job());
    ASSERT_TRUE(bench.run_until([&] { return bench.status().line >= 12; }, 900));
    bench.command(Command::pause);
    ASSERT_TRUE(bench.run_until([&] { return bench.status().state == MachineState::paused; }, 60));
    pins.lose = 1;
    bench.command(Command::resume);
    ASSERT_TRUE(bench.finish_job());
    EXPECT_EQ(bench.status().outcome, JobOutcome::completed);
    const twin::Report report = bench.report();
    EXPECT_FALSE(report.matches);
    ASSERT_FALSE(report.differences.empty());
    const std::string all = all_differences(report);
    EXPECT_NE(all.find("did not come back to the step: X -1, Y +0, Z +0"), std::string::npos) << all;
}

TEST(ParkedAndBack, AtAnyMomentAndAfterAnyJogs) {
    for (unsigned seed = 1; seed <= 12; ++seed) {
        std::mt19937 random(seed);
        const auto below = [&](int limit) {
            return static_cast<int>(random() % static_cast<unsigned>(limit));
        };
        PrinterBench bench;
        ASSERT_TRUE(bench.begin());
        bench.job(hot_job(seed % 2 == 0));
        ASSERT_TRUE(bench.run_until([&] { return bench.status().line >= 5; }, 900));
        for (int pauses = 0; pauses < 2; ++pauses) {
            bench.run(0.05 * below(200));
            if (bench.status().state != MachineState::printing) break;
            bench.command(Command::pause);
            ASSERT_TRUE(bench.run_until([&] { return bench.status().state == MachineState::paused; }, 60))
                << seed;
            for (int jogs = below(4); jogs > 0; --jogs) {
                const char axis = "XYZE"[below(4)];
                char line[40];
                std::snprintf(line, sizeof line, "G1 %c%.3f F%d", axis, (below(4000) - 2000) / 200.0,
                              300 + below(2000));
                bench.type("G91");
                bench.type("M83");
                bench.type(line);
                bench.run(0.1 * below(40));
            }
            bench.run(below(30));
            bench.command(Command::resume);
            ASSERT_TRUE(bench.run_until([&] { return bench.status().state != MachineState::paused; }, 5));
            bench.run(20);
        }
        ASSERT_TRUE(bench.finish_job()) << seed;
        const twin::Report report = bench.report();
        EXPECT_TRUE(report.matches) << "seed " << seed << ": " << all_differences(report);
    }
}

}  // namespace
}  // namespace qduino::tests::park_test
