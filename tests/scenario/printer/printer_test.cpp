// The printer sketch, whole, in virtual time: good jobs, bad jobs, people and broken hardware.
#include <gtest/gtest.h>

#include "tests/scenario/printer/printer_bench.h"
#include "tests/unit/twin/text_source.h"

namespace qduino::tests::printer_test {
namespace {

using link::Command;
using link::JobOutcome;
using link::MachineState;

constexpr std::string_view kSquare =
    "G28\nM109 S200\nG90\nM82\nG92 E0\nG1 Z0.2 F300\nM106 S255\nG1 X20 Y20 F6000\n"
    "G1 X40 Y20 E2 F1800\nG1 X40 Y40 E4\nG1 X20 Y40 E6\nG1 X20 Y20 E8\nG1 E6 F2400\nM107\nM104 S0\nM84\n";

/// A long job: homing, then many moves at 40 mm/s.
std::string long_job(int laps = 200) {
    std::string text = "G28\nG90\nG1 Z5 F300\nG1 F2400\n";
    for (int i = 0; i < laps; ++i) text += "G1 X100 Y10\nG1 X100 Y100\nG1 X10 Y100\nG1 X10 Y10\n";
    return text;
}

TEST(Printer, PrintsASquareAsAsked) {
    PrinterBench bench;
    ASSERT_TRUE(bench.begin());
    bench.job(std::string(kSquare));
    ASSERT_TRUE(bench.finish_job());
    EXPECT_EQ(bench.status().outcome, JobOutcome::completed) << bench.fault();
    EXPECT_EQ(bench.status().bytes_executed, kSquare.size());
    EXPECT_EQ(bench.status().unknown_codes, 0u);
    const twin::Report report = bench.report();
    EXPECT_TRUE(report.matches) << (report.differences.empty() ? "" : report.differences[0]);
    EXPECT_NEAR(report.findings.filament_built_mm, 6.0, 0.011);
    EXPECT_EQ(bench.metal().enabled[0], false) << "M84 switches the motors off";
    EXPECT_EQ(bench.heat().fan_duty, 0.0);
}

TEST(Printer, HomesToTheSwitchesFromAnywhere) {
    PrinterBench bench;
    ASSERT_TRUE(bench.begin());
    bench.type("G28");
    ASSERT_TRUE(bench.run_until([&] { return bench.status().homed[2]; }, 60));
    bench.run(1);
    const twin::PrinterState metal = bench.metal();
    EXPECT_NEAR(metal.position_mm[0], 0, 0.0126);
    EXPECT_NEAR(metal.position_mm[1], 0, 0.0126);
    EXPECT_NEAR(metal.position_mm[2], 0, 0.0005);
    bench.type("G1 X30 Y40 Z2 F3000");
    bench.run(5);
    EXPECT_NEAR(bench.metal().position_mm[0], 30, 0.0126);
    EXPECT_NEAR(bench.metal().position_mm[1], 40, 0.0126);
    EXPECT_NEAR(bench.metal().position_mm[2], 2, 0.0005);
}

TEST(Printer, ATypedMoveNeedsToKnowWhereTheAxisIsAsAJogDoes) {
    PrinterBench bench;
    ASSERT_TRUE(bench.begin());
    const auto before = bench.metal().position_steps;
    bench.type("G1 X10 F3000");
    bench.type("G2 X5 Y5 I2 F3000");
    bench.run(2);
    EXPECT_EQ(bench.metal().position_steps, before);
    EXPECT_NE(bench.replies().find("home first: nobody knows where X is before it has been homed"),
              std::string::npos)
        << bench.replies();
    EXPECT_EQ(bench.replies().find("assumed"), std::string::npos) << "and nothing is assumed";
    bench.type("G28 X");
    ASSERT_TRUE(bench.run_until([&] { return bench.status().homed[0]; }, 60));
    bench.type("G1 X10 F3000");
    bench.type("G1 Y10 F3000");
    bench.run(2);
    EXPECT_NEAR(bench.metal().position_mm[0], 10, 0.0126) << "X is known";
    EXPECT_EQ(bench.metal().position_steps[1], before[1]);
    EXPECT_NE(bench.replies().find("nobody knows where Y is"), std::string::npos) << bench.replies();
}

TEST(Printer, PauseComesToRestAndResumeGoesOn) {
    PrinterBench bench;
    ASSERT_TRUE(bench.begin());
    bench.job(long_job(3));
    ASSERT_TRUE(bench.run_until([&] { return bench.status().line > 6; }, 60));
    bench.command(Command::pause);
    ASSERT_TRUE(bench.run_until([&] { return bench.status().state == MachineState::paused; }, 20));
    const auto at_rest = bench.metal().position_steps;
    bench.run(20);
    EXPECT_EQ(bench.metal().position_steps, at_rest);
    bench.command(Command::resume);
    ASSERT_TRUE(bench.finish_job());
    EXPECT_EQ(bench.status().outcome, JobOutcome::completed);
    EXPECT_TRUE(bench.report().matches);
}

TEST(Printer, PauseWhileHeatingUpAndResume) {
    PrinterBench bench;
    ASSERT_TRUE(bench.begin());
    bench.job(std::string(kSquare));
    ASSERT_TRUE(bench.run_until([&] { return bench.heat().hot_end.celsius > 100; }, 200));
    bench.command(Command::pause);
    bench.run(5);
    EXPECT_EQ(bench.status().state, MachineState::paused);
    bench.run(200);
    EXPECT_EQ(bench.status().state, MachineState::paused);
    bench.command(Command::resume);
    ASSERT_TRUE(bench.finish_job());
    EXPECT_TRUE(bench.report().matches);
}

TEST(Printer, CancelComesToRestTurnsHeatOffAndTakesTheNextJob) {
    PrinterBench bench;
    ASSERT_TRUE(bench.begin());
    bench.type("M104 S180");
    bench.job(long_job());
    ASSERT_TRUE(bench.run_until([&] { return bench.status().line > 6; }, 60));
    bench.command(Command::cancel);
    ASSERT_TRUE(bench.finish_job(30));
    EXPECT_EQ(bench.status().outcome, JobOutcome::cancelled);
    EXPECT_EQ(bench.status().state, MachineState::idle);
    EXPECT_EQ(bench.heat().hot_end.target_celsius, 0);
    const auto at_rest = bench.metal().position_steps;
    bench.run(5);
    EXPECT_EQ(bench.metal().position_steps, at_rest);
    bench.job(std::string(kSquare), 2);
    ASSERT_TRUE(bench.run_until([&] { return bench.status().job_id == 2; }, 5));
    ASSERT_TRUE(bench.finish_job());
    EXPECT_EQ(bench.status().outcome, JobOutcome::completed) << bench.fault();
}

TEST(Printer, CancelDuringHomingStopsAndUnhomes) {
    PrinterBench bench;
    ASSERT_TRUE(bench.begin());
    bench.job(long_job());
    bench.run(0.6);
    bench.command(Command::cancel);
    ASSERT_TRUE(bench.finish_job(10));
    EXPECT_EQ(bench.status().outcome, JobOutcome::cancelled);
    EXPECT_FALSE(bench.status().homed[0]);
    const auto at_rest = bench.metal().position_steps;
    bench.run(3);
    EXPECT_EQ(bench.metal().position_steps, at_rest);
}

TEST(Printer, EmergencyStopsEverythingAtOnce) {
    PrinterBench bench;
    ASSERT_TRUE(bench.begin());
    bench.type("M104 S200");
    bench.job(long_job());
    ASSERT_TRUE(bench.run_until([&] { return bench.status().line > 6; }, 60));
    bench.emergency();
    const auto before = bench.metal().position_steps;
    bench.printer().run(bench.now() + 9ms);
    EXPECT_EQ(bench.metal().heater_duty[twin::kHotEnd], 0.0) << "loop 3 cuts the heat without asking loop 1";
    bench.run(2);
    for (std::size_t i = 0; i < 2; ++i) {
        EXPECT_LE(std::abs(bench.metal().position_steps[i] - before[i]), 2)
            << "loop 2 stops without asking loop 1";
    }
    EXPECT_EQ(bench.status().state, MachineState::faulted);
    EXPECT_EQ(bench.status().outcome, JobOutcome::failed);
    EXPECT_EQ(bench.fault(), "emergency stop");
    bench.type("G1 X10");
    bench.run(1);
    EXPECT_NE(bench.replies().find("the machine has a fault"), std::string::npos) << bench.replies();
    bench.command(Command::clear_fault);
    bench.run(0.5);
    EXPECT_EQ(bench.status().state, MachineState::idle);
    bench.type("G28");
    EXPECT_TRUE(bench.run_until([&] { return bench.status().homed[2]; }, 60));
}

TEST(Printer, M112InAJobStopsIt) {
    PrinterBench bench;
    ASSERT_TRUE(bench.begin());
    bench.job("G28\nM112\nG1 X100 F3000\n");
    ASSERT_TRUE(bench.finish_job(60));
    EXPECT_EQ(bench.status().state, MachineState::faulted);
    EXPECT_NE(bench.fault().find("M112"), std::string::npos);
}

struct BadLine {
    const char* name;
    const char* line;
    const char* words;
};
class PrinterRefuses : public testing::TestWithParam<BadLine> {};

TEST_P(PrinterRefuses, TheLineAndNothingMovesAfterIt) {
    PrinterBench bench;
    ASSERT_TRUE(bench.begin());
    bench.job("G28\nG1 X10 Y10 F3000\n" + std::string(GetParam().line) + "\nG1 X90 Y90\n");
    ASSERT_TRUE(bench.finish_job(120));
    EXPECT_EQ(bench.status().outcome, JobOutcome::failed);
    EXPECT_NE(bench.fault().find(GetParam().words), std::string::npos) << bench.fault();
    EXPECT_NE(bench.fault().find("3"), std::string::npos) << "the line is named: " << bench.fault();
    bench.run(2);
    EXPECT_LE(bench.metal().position_mm[0], 10.02);
    EXPECT_EQ(bench.heat().hot_end.target_celsius, 0);
}
INSTANTIATE_TEST_SUITE_P(Bad, PrinterRefuses,
                         testing::Values(BadLine{"OutOfBounds", "G1 X200", "X"},
                                         BadLine{"TooHot", "M104 S999", "999"},
                                         BadLine{"Malformed", "G1 X1.2.3", "line"},
                                         BadLine{"ColdExtrusion", "G1 X20 E5", "heat it first"},
                                         BadLine{"NotANumber", "G1 Xnan", "line"},
                                         BadLine{"BedTooHot", "M140 S400", "400"}),
                         [](const auto& each) { return each.param.name; });

TEST(Printer, UnknownCodesAreAnsweredAndSkipped) {
    PrinterBench bench;
    ASSERT_TRUE(bench.begin());
    bench.job("G28\nM9876\nG1 X10 F3000\n");
    ASSERT_TRUE(bench.finish_job(60));
    EXPECT_EQ(bench.status().outcome, JobOutcome::completed);
    EXPECT_EQ(bench.status().unknown_codes, 1u);
    EXPECT_NE(bench.replies().find("M9876"), std::string::npos);
}

/// Two objects of 60 lines a layer, 20 layers: number 0 left of X 60, number 1 right of it. Each
/// line pushes 0.05 mm.
std::string two_objects() {
    std::string text = "G28\nM109 S200\nM83\nG1 X10 Y10 Z1 F3000\n";
    const auto object = [&](int number, int from, int to) {
        text += "M486 S" + std::to_string(number) + "\nG1 X" + std::to_string(from) + " Y20 F3000\n";
        text += "G1 E0.5 F1500\nG1 F3000\n";
        for (int i = 0; i < 60; ++i)
            text +=
                "G1 X" + std::to_string(i % 2 == 0 ? to : from) + " Y" + std::to_string(20 + i) + " E0.05\n";
        text += "G1 E-0.5 F1500\nM486 S-1\n";
    };
    for (int layer = 1; layer <= 20; ++layer) {
        text += "G1 Z" + std::to_string(layer) + " F300\n";
        object(0, 20, 50);
        object(1, 100, 130);
    }
    return text + "G1 X10 F3000\nG1 Z25 F300\n";
}

TEST(Printer, AnObjectMayBeLeftOutWhileAJobRunsOrIsPaused) {
    for (const bool paused : {false, true}) {
        PrinterBench bench;
        ASSERT_TRUE(bench.begin());
        bench.job(two_objects());
        ASSERT_TRUE(bench.run_until([&] { return bench.status().line > 30; }, 600));
        if (paused) {
            bench.command(Command::pause);
            ASSERT_TRUE(bench.run_until([&] { return bench.status().state == MachineState::paused; }, 60));
        }
        bench.type("M486 P1");
        bench.run(1);
        if (paused) bench.command(Command::resume);
        // What was planned by then is played; nothing right of 60 afterwards.
        const std::uint64_t planned = bench.status().bytes_planned;
        ASSERT_TRUE(bench.run_until([&] { return bench.status().bytes_executed >= planned; }, 600));
        ASSERT_TRUE(bench.run_until([&] { return bench.metal().position_mm[0] < 60; }, 600));
        double rightmost = 0;
        while (bench.status().outcome == JobOutcome::running) {
            bench.run(0.05);
            rightmost = std::max(rightmost, bench.metal().position_mm[0]);
        }
        EXPECT_EQ(bench.status().outcome, JobOutcome::completed) << bench.fault();
        EXPECT_LT(rightmost, 51);
        EXPECT_NEAR(bench.metal().position_mm[0], 10, 0.0126);
        EXPECT_NEAR(bench.metal().position_mm[2], 25, 0.0005);
        EXPECT_GT(bench.metal().position_mm[3], 20 * 60 * 0.05 - 0.1) << "with all its filament";
        EXPECT_LT(bench.metal().position_mm[3], 26 * 60 * 0.05) << "the planner was six layers ahead at most";
        const twin::Report report = bench.report();
        EXPECT_TRUE(report.matches) << (report.differences.empty() ? "" : report.differences[0]);
    }
}

/// Two copies of a model whose names differ in the 99th byte. The line that leaves one out is
/// longer than most, and the twin must be told all of it.
TEST(Printer, ATypedNameIsWholeForTheMachineAndForTheTwin) {
    const std::string name = "EXCLUDE_OBJECT_START NAME=" + std::string(98, 'm') + "_copy_";
    std::string text = two_objects();
    for (const char number : {'0', '1'}) {
        const std::string label = std::string("M486 S") + number + "\n";
        for (std::size_t at = text.find(label); at != std::string::npos; at = text.find(label))
            text.replace(at, label.size(), name + number + "\n");
    }
    PrinterBench bench;
    ASSERT_TRUE(bench.begin());
    bench.job(text);
    ASSERT_TRUE(bench.run_until([&] { return bench.status().line > 30; }, 600));
    bench.type("EXCLUDE_OBJECT NAME=" + std::string(98, 'm') + "_copy_1");
    ASSERT_TRUE(bench.finish_job(3600));
    EXPECT_EQ(bench.status().outcome, JobOutcome::completed) << bench.fault();
    EXPECT_GT(bench.metal().position_mm[3], 20 * 60 * 0.05 - 0.1) << "the other copy is whole";
    EXPECT_LT(bench.metal().position_mm[3], 26 * 60 * 0.05);
    const twin::Report report = bench.report();
    EXPECT_TRUE(report.matches) << (report.differences.empty() ? "" : report.differences[0]);
}

TEST(Printer, AMacroHomesAndHeatsBeforeTheJobGoesOn) {
    printer::MachineConfig machine;
    machine.macros.push_back({"PRINT_START", "G28\nM109 S{EXTRUDER}\nM117 ready"});
    PrinterBench bench{machine};
    ASSERT_TRUE(bench.begin());
    bench.job("PRINT_START EXTRUDER=205\nM83\nG1 Z0.2 F300\nG1 X30 E1 F1800\n");
    ASSERT_TRUE(bench.finish_job());
    EXPECT_EQ(bench.status().outcome, JobOutcome::completed) << bench.fault();
    EXPECT_EQ(bench.status().message.view(), "ready");
    EXPECT_EQ(bench.heat().hot_end.target_celsius, 0) << "what has printed leaves no heat";
    const twin::Report report = bench.report();
    EXPECT_TRUE(report.matches) << (report.differences.empty() ? "" : report.differences[0]);
}

struct Broken {
    const char* name;
    const char* fault;
    const char* words;
};
class PrinterNotices : public testing::TestWithParam<Broken> {};

TEST_P(PrinterNotices, CutsHeatAndFailsTheJob) {
    PrinterBench bench;
    ASSERT_TRUE(bench.begin());
    const auto fault = twin::parse_fault(GetParam().fault);
    ASSERT_TRUE(fault.ok()) << fault.error().message.view();
    bench.twin().inject(*fault);
    bench.job(std::string(kSquare) + "M109 S200\nG4 S600\n");
    ASSERT_TRUE(bench.run_until([&] { return bench.status().state == MachineState::faulted; }, 1500));
    EXPECT_NE(bench.fault().find(GetParam().words), std::string::npos) << bench.fault();
    bench.run(1);
    EXPECT_EQ(bench.status().outcome, JobOutcome::failed);
    EXPECT_EQ(bench.metal().heater_duty[twin::kHotEnd], 0.0);
    EXPECT_EQ(bench.metal().heater_duty[twin::kBed], 0.0);
    const auto at_rest = bench.metal().position_steps;
    bench.run(3);
    EXPECT_EQ(bench.metal().position_steps, at_rest);
}
INSTANTIATE_TEST_SUITE_P(
    Hardware, PrinterNotices,
    testing::Values(Broken{"StuckThermistor", "sensor_stuck:hot_end@30", "hot end"},
                    Broken{"OpenThermistor", "sensor_open:hot_end@30", "hot end sensor"},
                    Broken{"ShortedThermistor", "sensor_short:hot_end@30", "hot end sensor"},
                    Broken{"HeaterDisconnected", "heater_disconnected:hot_end@30", "does not heat up"},
                    Broken{"SilentBus", "bus_silent@30", "does not answer"},
                    Broken{"EndstopNeverCloses", "endstop_stuck_open:y", "Y endstop"},
                    Broken{"EndstopAlwaysClosed", "endstop_stuck_closed:x", "X endstop"}),
    [](const auto& each) { return each.param.name; });

TEST(Printer, AFaultThatIsStillThereIsNotCleared) {
    PrinterBench bench;
    ASSERT_TRUE(bench.begin());
    bench.job(std::string(kSquare));
    ASSERT_TRUE(bench.run_until([&] { return bench.status().line >= 9; }, 600));
    const std::uint64_t line = bench.status().line;
    bench.twin().inject(*twin::parse_fault("sensor_open:hot_end"));
    bench.run(1);
    ASSERT_EQ(bench.status().state, MachineState::faulted);
    EXPECT_FALSE(bench.heat().hot_end.reading);
    EXPECT_NE(bench.status().fault_persists.view().find("hot end sensor"), std::string_view::npos);
    bench.command(Command::clear_fault);
    bench.run(1);
    EXPECT_EQ(bench.status().state, MachineState::faulted);
    EXPECT_NE(bench.replies().find("the fault is still there: hot end sensor"), std::string::npos);
    bench.twin().clear_faults(bench.now());
    bench.run(1);
    EXPECT_TRUE(bench.status().fault_persists.empty());
    bench.command(Command::clear_fault);
    bench.run(1);
    EXPECT_EQ(bench.status().state, MachineState::idle);
    EXPECT_TRUE(bench.heat().hot_end.reading);
    EXPECT_GE(bench.status().line, line) << "where it stopped is kept";
    EXPECT_EQ(bench.status().outcome, JobOutcome::failed);
}

TEST(Printer, FanAndHeatFollowTheMotionNotTheParser) {
    PrinterBench bench;
    ASSERT_TRUE(bench.begin());
    // The fan line is read at once, but stands behind a move of 18 s.
    bench.job("G28\nG1 X0 Y0 F3000\nG1 X90 F300\nM106 S128\nG1 X0 F3000\n");
    ASSERT_TRUE(
        bench.run_until([&] { return bench.metal().position_mm[0] > 5 && bench.status().homed[2]; }, 60));
    bench.run(3);
    EXPECT_EQ(bench.heat().fan_duty, 0.0);
    ASSERT_TRUE(bench.finish_job(60));
    EXPECT_NEAR(bench.heat().fan_duty, 128.0 / 255, 0.01);
}

TEST(Printer, AJobThatTrickesInComesToRestAndGoesOn) {
    PrinterBench bench;
    ASSERT_TRUE(bench.begin());
    const std::string text = "G28\nG1 X50 F3000\nG1 X60 Y10\nG1 X10 Y50\n";
    ASSERT_TRUE(link::try_push(bench.printer().link().jobs, link::encode(link::JobBegin{1, text.size()})));
    twin::Job watch(bench.twin(), std::make_unique<twin::TextSource>(text), bench.now());
    for (std::size_t i = 0; i < text.size(); ++i) {
        const std::uint8_t byte = static_cast<std::uint8_t>(text[i]);
        ASSERT_TRUE(link::try_push(bench.printer().link().jobs,
                                   link::encode(link::JobBytes{1, i, std::span{&byte, 1}})));
        bench.run(0.7);
    }
    EXPECT_EQ(bench.status().outcome, JobOutcome::running) << "the end has not been said";
    ASSERT_TRUE(link::try_push(bench.printer().link().jobs, link::encode(link::JobEnd{1})));
    ASSERT_TRUE(bench.finish_job(60));
    EXPECT_EQ(bench.status().outcome, JobOutcome::completed);
    EXPECT_EQ(bench.motion().starved, 0u) << "the motion came to rest by plan";
    EXPECT_TRUE(watch.finish(bench.now()).matches);
}

TEST(Printer, RepeatedBytesOfAReturningServiceAreDropped) {
    PrinterBench bench;
    ASSERT_TRUE(bench.begin());
    const std::string text = "G28\nG1 X50 F3000\nG91\nG1 X10\nG1 X10\n";
    const auto push = [&](std::size_t from, std::size_t to) {
        const auto* bytes = reinterpret_cast<const std::uint8_t*>(text.data());
        return link::try_push(bench.printer().link().jobs,
                              link::encode(link::JobBytes{7, from, std::span{bytes + from, to - from}}));
    };
    ASSERT_TRUE(link::try_push(bench.printer().link().jobs, link::encode(link::JobBegin{7, text.size()})));
    ASSERT_TRUE(push(0, 30));
    ASSERT_TRUE(push(10, 20));
    ASSERT_TRUE(push(32, 34));  // a gap: refused
    ASSERT_TRUE(link::try_push(bench.printer().link().jobs, link::encode(link::JobBegin{7, text.size()})));
    ASSERT_TRUE(push(5, text.size()));
    ASSERT_TRUE(link::try_push(bench.printer().link().jobs, link::encode(link::JobEnd{7})));
    ASSERT_TRUE(bench.run_until([&] { return bench.status().outcome == JobOutcome::completed; }, 60));
    EXPECT_NEAR(bench.metal().position_mm[0], 70, 0.0126) << "each relative move was made once";
}

TEST(Printer, TypedLinesAreAnswered) {
    PrinterBench bench;
    ASSERT_TRUE(bench.begin());
    bench.type("M105");
    bench.type("M114");
    bench.type("M115");
    bench.run(1);
    EXPECT_NE(bench.replies().find("T:"), std::string::npos) << bench.replies();
    EXPECT_NE(bench.replies().find("X:0.00 Y:0.00 Z:0.00 E:0.00 Count X:"), std::string::npos);
    EXPECT_NE(bench.replies().find("FIRMWARE_NAME:"), std::string::npos);
}

TEST(Printer, WhileAJobRunsTypedMovesAreRefused) {
    PrinterBench bench;
    ASSERT_TRUE(bench.begin());
    bench.job(long_job(3));
    bench.run(5);
    bench.type("G1 X140");
    bench.type("M220 S50");
    bench.run(1);
    EXPECT_NE(bench.replies().find("G1 was not done: a job runs"), std::string::npos);
    EXPECT_EQ(bench.status().feed_factor, 0.5);
    ASSERT_TRUE(bench.finish_job());
    EXPECT_TRUE(bench.report().matches);
}

TEST(Printer, AJobThatArrivesWhileFaultedIsRefused) {
    PrinterBench bench;
    ASSERT_TRUE(bench.begin());
    bench.emergency();
    bench.run(1);
    bench.job(std::string(kSquare), 5);
    bench.run(1);
    EXPECT_EQ(bench.status().job_id, 5u);
    EXPECT_EQ(bench.status().outcome, JobOutcome::failed);
    bench.command(Command::clear_fault);
    bench.run(60);
    EXPECT_EQ(bench.metal().counters[0].moved, 0u) << "it does not start after the repair";
}

/// Every level and duty that a pin was ever driven to; nothing is wired to it.
class DrivenPins final : public board::NoPeripherals {
  public:
    void pin_written(Instant, board::PinId pin, board::Level level) override {
        driven[pin.number].push_back(level == board::Level::high ? 1.0 : 0.0);
    }
    void pwm_written(Instant, board::PinId pin, double duty) override { driven[pin.number].push_back(duty); }
    std::map<std::uint16_t, std::vector<double>> driven;
};

TEST(Printer, FromPowerUpOnNoDriverAndNoHeaterIsOnForAMoment) {
    DrivenPins pins;
    PrinterBench bench;
    ASSERT_TRUE(bench.begin(&pins));
    const printer::MachineConfig& config = bench.printer().config();
    for (const printer::AxisConfig& axis : config.axes) {
        const std::vector<double>& enable = pins.driven[axis.enable_pin];
        ASSERT_FALSE(enable.empty());
        EXPECT_EQ(std::count(enable.begin(), enable.end(), 0.0), 0) << "EN low switches the driver on";
        EXPECT_FALSE(pins.driven[axis.step_pin].empty());
    }
    for (const std::uint16_t heater : {config.hot_end.heater_pin, config.bed.heater_pin, config.fan_pin}) {
        const std::vector<double>& duties = pins.driven[heater];
        ASSERT_FALSE(duties.empty());
        EXPECT_EQ(std::count(duties.begin(), duties.end(), 0.0), std::ssize(duties));
    }
}

}  // namespace
}  // namespace qduino::tests::printer_test
