// A job makes the same steps whatever was printed before it. The commands that could leave
// something come from the table of all commands, so none can be forgotten: a new one needs an
// example here.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

#include "printer/gcode/command_table.h"
#include "tests/scenario/printer/printer_bench.h"

namespace qduino::tests::leftover_test {
namespace {

using link::JobOutcome;
using printer::gcode::Code;
using printer::gcode::CodeInfo;

/// One rising edge of a motor's STEP pin.
struct Edge {
    Instant at;
    int motor;
    bool forward;
};

class EdgeNotes final : public board::ForwardingPeripherals {
  public:
    explicit EdgeNotes(const printer::MachineConfig& machine) {
        for (int motor = 0; motor < 4; ++motor) {
            step_pin_[motor] = machine.axes[static_cast<std::size_t>(motor)].step_pin;
            direction_pin_[motor] = machine.axes[static_cast<std::size_t>(motor)].direction_pin;
        }
    }
    void pin_written(Instant now, board::PinId pin, board::Level level) override {
        const bool high = level == board::Level::high;
        for (int motor = 0; motor < 4; ++motor) {
            if (pin.number == direction_pin_[motor]) forward_[motor] = high;
            if (pin.number != step_pin_[motor]) continue;
            if (high && !high_[motor]) edges.push_back({now, motor, forward_[motor]});
            high_[motor] = high;
        }
        ForwardingPeripherals::pin_written(now, pin, level);
    }
    std::vector<Edge> edges;

  private:
    std::array<int, 4> step_pin_{}, direction_pin_{};
    std::array<bool, 4> forward_{}, high_{};
};

/// What a job says with each code, with numbers far from the machine's own.
const std::map<std::string, std::string> kExamples{
    {"ACTIVATE_EXTRUDER", "ACTIVATE_EXTRUDER EXTRUDER=extruder"},
    {"BED_MESH_CALIBRATE", "BED_MESH_CALIBRATE"},
    {"BED_MESH_CLEAR", "G29\nBED_MESH_CLEAR"},
    {"BED_MESH_PROFILE", "G29\nBED_MESH_PROFILE SAVE=a\nBED_MESH_PROFILE LOAD=a"},
    {"END_CURRENT_OBJECT", "START_CURRENT_OBJECT NAME=a\nEND_CURRENT_OBJECT NAME=a"},
    {"EXCLUDE_OBJECT", "EXCLUDE_OBJECT NAME=part"},
    {"EXCLUDE_OBJECT_END", "EXCLUDE_OBJECT_START NAME=a\nEXCLUDE_OBJECT_END NAME=a"},
    {"EXCLUDE_OBJECT_START", "EXCLUDE_OBJECT NAME=part\nEXCLUDE_OBJECT_START NAME=part"},
    {"START_CURRENT_OBJECT", "EXCLUDE_OBJECT NAME=part\nSTART_CURRENT_OBJECT NAME=part"},
    {"F0", "F100"},
    {"GET_POSITION", "GET_POSITION"},
    {"PAUSE", "PAUSE"},
    {"RESTORE_GCODE_STATE", "SAVE_GCODE_STATE NAME=a\nG91\nRESTORE_GCODE_STATE NAME=a"},
    {"S0", "S5000"},
    {"SAVE_GCODE_STATE", "G91\nM220 S50\nSAVE_GCODE_STATE NAME=a"},
    {"SET_GCODE_OFFSET", "SET_GCODE_OFFSET X=3 Z=0.5"},
    {"SET_HEATER_TEMPERATURE", "SET_HEATER_TEMPERATURE HEATER=extruder TARGET=50"},
    {"SET_INPUT_SHAPER", "SET_INPUT_SHAPER SHAPER_FREQ_X=30 SHAPER_TYPE_X=zvd"},
    {"SET_PRESSURE_ADVANCE", "SET_PRESSURE_ADVANCE ADVANCE=0.5 SMOOTH_TIME=0.1"},
    {"SET_SKEW", "SET_SKEW XY=100,102,70"},
    {"SET_VELOCITY_LIMIT", "SET_VELOCITY_LIMIT VELOCITY=10 ACCEL=50 SQUARE_CORNER_VELOCITY=1"},
    {"TEMPERATURE_WAIT", "M104 S30\nTEMPERATURE_WAIT SENSOR=extruder MINIMUM=5"},
    {"TURN_OFF_HEATERS", "TURN_OFF_HEATERS"},
    {"G0", "G0 X50 F300"},
    {"G1", "G1 X50 E3.3337 F300"},
    {"M2", "G91\nM2"},
    {"M30", "G91\nM30"},
    {"G2", "G2 X60 Y50 I5 J0 E1 F600"},
    {"G3", "G3 X60 Y50 I5 J0 E1 F600"},
    {"G4", "G4 P100"},
    {"G5", "G5 X60 Y50 I0 J5 P0 Q-5 F600"},
    {"G10", "G10"},
    {"G11", "M208 S2\nG10\nG11"},
    {"G17", "G18\nG17"},
    {"G18", "G18"},
    {"G19", "G19"},
    {"G20", "G20"},
    {"G21", "G21"},
    {"G28", "G28 X"},
    {"G29", "G29"},
    {"G40", "G40"},
    {"G49", "G49"},
    {"G54", "G54"},
    {"G80", "G80"},
    {"G90", "G90"},
    {"G91", "G91"},
    {"G91.1", "G91.1"},
    {"G92", "G92 X10 Y10 Z3 E7"},
    {"G92.1", "G92 X10\nG92.1"},
    {"G94", "G94"},
    {"M0", "M0"},
    {"M1", "M1"},
    {"M6", "M6 T0"},
    {"M18", "M18 S30"},
    {"M25", "M25"},
    {"M73", "M73 P50 R10"},
    {"M82", "M82"},
    {"M83", "M83"},
    {"M84", "M84"},
    {"M92", "M92 E110"},
    {"M104", "M104 S60"},
    {"M105", "M105"},
    {"M106", "M106 S255"},
    {"M107", "M107"},
    {"M108", "M108"},
    {"M109", "M109 S30"},
    {"M110", "M110 N5"},
    {"M113", "M113 S2"},
    {"M114", "M114"},
    {"M115", "M115"},
    {"M116", "M116"},
    {"M117", "M117 hello"},
    {"M118", "M118 hello"},
    {"M125", "M125"},
    {"M140", "M140 S30"},
    {"M155", "M155 S1"},
    {"M190", "M190 S21"},
    {"M200", "M200 D1.75 L1"},
    {"M201", "M201 X50 Y50 Z5 E100"},
    {"M203", "M203 X5 Y5 Z1 E1"},
    {"M204", "M204 P50 T50 R50"},
    {"M205", "M205 X1 Y1 Z0.1 E0.1"},
    {"M206", "M206 X2 Y2 Z0.2"},
    {"M207", "M207 S1 F600 Z1"},
    {"M208", "M208 S1 F600"},
    {"M220", "M220 S20"},
    {"M221", "M221 S50"},
    {"M226", "M226"},
    {"M301", "M301 P1 I1 D1"},
    {"M302", "M302 S200"},
    {"M303", "M303 E-1 S50 C3 U1"},
    {"M304", "M304 P1 I1 D1"},
    {"M306", "M306 P30 C10"},
    {"M400", "M400"},
    {"M410", "M410"},
    {"M420", "M420 S1 Z50"},
    {"M428", "G28\nM428"},
    {"M486", "M486 P1\nM486 S1"},
    {"M500", "M500"},
    {"M501", "M501"},
    {"M502", "M502"},
    {"M503", "M503"},
    {"M568", "M568 P0 S60"},
    {"M572", "M572 D0 S0.5"},
    {"M593", "M593 F30"},
    {"M600", "M600"},
    {"M601", "M601"},
    {"M852", "M852 I0.05"},
    {"M900", "M900 K0.5"},
    {"T0", "T0"},
};
/// M112 ends the job in a fault, and the fault ends what it has set.
const std::set<std::string> kNoExample{"M112"};

std::string name_of(const Code& code) {
    if (code.letter == '\0') return std::string{code.word};
    std::string name = code.letter + std::to_string(code.number);
    if (code.subcode >= 0) name += "." + std::to_string(code.subcode);
    return name;
}

/// Filament moves cold, so no time goes by in heating.
printer::MachineConfig machine() {
    printer::MachineConfig config;
    config.minimum_extrude = Celsius{0};
    config.probe.pin = 20;
    config.mesh.points = {2, 2};
    return config;
}

/// Everything that settings show in: corners, ramps, Z, filament along a way and alone, an arc, a
/// retraction of the firmware's, labels.
const std::string kMeasured =
    "G28\nG4 S2\nG1 X20 Y20 Z2 F6000\nG1 X60 E2 F3600\nG1 Y40 E3\nG3 X50 Y50 I-10 J0 E4\nG10\nG1 X30 Y30\n"
    "G11\nG1 Z4 F300\nM486 S1\nG1 X80 Y30 E6 F6000\nM486 S-1\nEXCLUDE_OBJECT_START NAME=part\nG1 X90 E7\n"
    "EXCLUDE_OBJECT_END NAME=part\nG1 X20 F7500\nG1 Y90 E9\nG1 Z12 F300\n";

class Bench {
  public:
    Bench() : notes_(config_), bench_(config_) { notes_.forward_to(bench_.twin()); }
    bool begin() { return bench_.begin(&notes_); }
    PrinterBench& printer() { return bench_; }

    void print(const std::string& text) {
        notes_.edges.clear();
        bench_.job(text, ++job_);
        const auto over = [&] {
            const link::JobStatus status = bench_.status();
            if (status.state == link::MachineState::paused) bench_.command(link::Command::resume);
            return status.job_id == job_ && status.outcome != JobOutcome::running;
        };
        ASSERT_TRUE(bench_.run_until(over, 2000)) << text;
        ASSERT_EQ(bench_.status().outcome, JobOutcome::completed) << text << bench_.fault();
        bench_.run(0.3);
    }
    /// Begins `text`, and cancels it in its moves.
    void cancel(const std::string& text) {
        bench_.job(text, ++job_);
        ASSERT_TRUE(bench_.run_until([&] { return bench_.status().homed[2]; }, 100));
        bench_.run(1);
        bench_.command(link::Command::cancel);
        ASSERT_TRUE(bench_.run_until([&] { return bench_.status().outcome == JobOutcome::cancelled; }, 100));
        bench_.run(1);
    }
    /// The edges that kMeasured makes behind its dwell.
    std::vector<Edge> measured() {
        print(kMeasured);
        const auto& edges = notes_.edges;
        for (std::size_t i = 1; i < edges.size(); ++i)
            if (edges[i].at - edges[i - 1].at > 1900ms)
                return {edges.begin() + static_cast<long>(i), edges.end()};
        return {};
    }

  private:
    printer::MachineConfig config_ = machine();
    EdgeNotes notes_;
    PrinterBench bench_;
    std::uint64_t job_ = 0;
};

std::vector<Edge> of_a_fresh_printer() {
    Bench fresh;
    return fresh.begin() ? fresh.measured() : std::vector<Edge>{};
}

/// The same steps in the same order; each instant, by the print's own clock, to its last digit.
void expect_same(const std::vector<Edge>& seen, const std::vector<Edge>& fresh, const std::string& behind) {
    ASSERT_FALSE(fresh.empty());
    ASSERT_EQ(seen.size(), fresh.size()) << "behind " << behind;
    for (std::size_t i = 0; i < seen.size(); ++i) {
        const Nanoseconds at = seen[i].at - seen[0].at, expected = fresh[i].at - fresh[0].at;
        ASSERT_LE(std::abs((at - expected).count()), 2) << "step " << i << " of motor " << seen[i].motor
                                                        << ", " << to_seconds(at) << " s, behind " << behind;
        ASSERT_EQ(seen[i].motor, fresh[i].motor) << "step " << i << " behind " << behind;
        ASSERT_EQ(seen[i].forward, fresh[i].forward) << "step " << i << " behind " << behind;
    }
}

TEST(Leftovers, EveryCommandThatDoesSomethingHasAnExample) {
    for (const CodeInfo& code : printer::gcode::known_codes()) {
        if (code.handler == nullptr || is_refused(code)) continue;
        const std::string name = name_of(code.code);
        EXPECT_TRUE(kExamples.contains(name) || kNoExample.contains(name))
            << name << ": write a line here that changes as much as it can";
    }
}

TEST(Leftovers, AJobMakesTheSameStepsBehindAnyOther) {
    const std::vector<Edge> expected = of_a_fresh_printer();
    Bench used;
    ASSERT_TRUE(used.begin());
    for (const auto& [name, lines] : kExamples) {
        used.print("G28\nG1 X50 Y50 Z5 F6000\n" + lines + "\n");
        if (testing::Test::HasFatalFailure()) return;
        expect_same(used.measured(), expected, name);
    }
}

TEST(Leftovers, OfACancelledJobNothingIsLeftEither) {
    const std::vector<Edge> expected = of_a_fresh_printer();
    Bench used;
    ASSERT_TRUE(used.begin());
    used.cancel("G28\nM203 X5 Y5\nM201 X50\nM900 K0.5\nM593 F30\nM852 I0.05\nG1 X100 E1 F6000\nG1 X10\n");
    expect_same(used.measured(), expected, "a cancelled job");
}

TEST(Leftovers, WhatAPersonSetsBetweenJobsHolds) {
    Bench bench;
    ASSERT_TRUE(bench.begin());
    const std::vector<Edge> before = bench.measured();
    bench.printer().type("M203 X20");
    bench.printer().run(0.5);
    const std::vector<Edge> slower = bench.measured();
    EXPECT_GT(slower.back().at - slower.front().at, (before.back().at - before.front().at) + 1s);
    bench.print("G28\nM203 X5\n");
    expect_same(bench.measured(), slower, "a job with M203");
}

}  // namespace
}  // namespace qduino::tests::leftover_test
