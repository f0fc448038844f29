// The dialect as real files write it: planes and splines, volumetric extrusion, offsets, Klipper's
// words, macros, objects that are left out. A program in, the actions that it asks for out.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "recorder.h"

namespace qduino::printer::gcode::interpreter_dialect_test {
namespace {

using Log = std::vector<std::string>;

struct Case {
    const char* name;
    const char* program;
    Log expected;
};

/// Every program begins at the home position, homed.
void check(const std::vector<Case>& cases, const MachineConfig& machine = {}) {
    for (const Case& c : cases) {
        Bench bench{machine};
        (void)bench.run("G28\n");
        EXPECT_EQ(bench.run(c.program), c.expected) << c.name;
    }
}

TEST(Dialect, LettersOfOtherMachinesChangeNothing) {
    check({
        {"RepRapFirmware's plain move", "G0 X5 S0 F60\nG1 X6 H0\n", {"travel X5 at 1", "travel X6 at 1"}},
        {"a move that ends at a switch",
         "G1 X5 S1 F60\n",
         {"error: line 1, G1: S1 asks for a move that ends at a switch: only G28 does that here"}},
        {"axes that are not there beside those that are", "G28 X0 U0\n", {"home X"}},
        {"only axes that are not there",
         "G28 U0\n",
         {"warning line 1: the axes of this G28 are not there: nothing to home"}},
        {"Prusa's and Marlin's flags", "G28 W\nG28 R5 L\n", {"home XYZ", "home XYZ"}},
        {"gains of a hot end that is not there", "M301 E1 P9\n", {}},
        {"gains that count otherwise",
         "M301 H1 P9\n",
         {"error: line 1, M301: H is RepRapFirmware's, whose gains count otherwise"}},
        {"a tool change", "M6 T0\nM6 T2\n", {"error: line 2, M6: this machine has one tool, T0"}},
        {"how an echo is told",
         "M118 A1 P0 action:notify x\nM118 E1 hello\nM118 A2\n",
         {"echo line 1: //action:notify x", "echo line 2: hello", "echo line 3: A2"}},
        {"fans with high numbers", "M107 P101\n", {"fan 101 0"}},
    });
}

TEST(Dialect, ToolsThatAreNotThereMayBeOff) {
    check({
        {"off is harmless", "M104 S0 T1\nM109 T3 R0\nG10 P1 S0 R0\n", {}},
        {"on is not", "M104 S200 T1\n", {"error: line 1, M104: this machine has one tool, T0"}},
        {"nor by a tool's settings", "G10 P1 S200\n", {"error: line 1, G10: this machine has one tool, T0"}},
        {"T0 is there",
         "M104 S200 T0\nG10 P0 S210 R180\nM568 P0 S205\n",
         {"set hot end 200", "set hot end 210", "set hot end 205"}},
        {"its flow is another's", "M83\nM221 T1 S50\nG1 E1 F60\n", {"factors 1 1", "filament E1 at 1"}},
        {"Klipper's names of it",
         "ACTIVATE_EXTRUDER EXTRUDER=extruder\nACTIVATE_EXTRUDER EXTRUDER=extruder1\n",
         {"error: line 2, ACTIVATE_EXTRUDER: this machine has one tool, T0"}},
    });
}

TEST(Dialect, Coordinates) {
    check({
        {"a letter by itself is 0 in G92",
         "G1 X10 Y10 F60\nG92 X Y5\nG1 X1 Y6\n",
         {"travel X10 Y10 at 1", "travel X11 Y11 at 1"}},
        {"axes of other machines in G92", "G92 E0 U0 A0\n", {}},
        {"M206 shifts at once, and outlasts a G28",
         "M206 X-2\nG1 X10 F60\nG28 X\nG1 X10\n",
         {"travel X12 at 1", "home X", "travel X12 at 1"}},
        {"G92.1 goes back to what M206 made of the machine",
         "M206 X-2\nG92 X50\nG92.1\nG1 X10 F60\n",
         {"travel X12 at 1"}},
        {"M428 near the switch",
         "G1 X3 Y2 F60\nM428\nG1 X10 Y10\n",
         {"travel X3 Y2 at 1", "travel X13 Y12 at 1"}},
        {"M428 far from it",
         "G1 X30 F60\nM428\n",
         {"travel X30 at 1", "error: line 2, M428: X is more than 20 mm from its home position"}},
        {"SET_GCODE_OFFSET shifts from the next move on, and outlasts a G28",
         "SET_GCODE_OFFSET X=2 Z_ADJUST=0.1\nSET_GCODE_OFFSET z_adjust=0.1\nG1 X10 Z1 F60\nG28 X\nG1 X1\n",
         {"travel X12 Z1.2 at 1", "home X", "travel X3 at 1"}},
        {"… or moves there at once",
         "SET_GCODE_OFFSET X=2 MOVE=1 MOVE_SPEED=5\nG1 X10 F60\n",
         {"travel X2 at 5", "travel X12 at 1"}},
        {"… of filament, too", "SET_GCODE_OFFSET E=2\nG1 E1 F60\n", {"filament E3 at 1"}},
        {"… by a number",
         "SET_GCODE_OFFSET X=2mm\n",
         {"error: line 1, SET_GCODE_OFFSET: X=2mm is not a number"}},
    });
}

TEST(Dialect, AWordWhoseEndWouldBeLostIsRefused) {
    const std::string program = "SET_GCODE_OFFSET " + std::string(300, 'A') + " X=2\n";
    check({{"a number that may be behind the cut",
            program.c_str(),
            {"error: line 1, SET_GCODE_OFFSET: what follows it is longer than the 256 bytes that may: the "
             "rest would be lost"}}});
}

TEST(Dialect, Filament) {
    check({
        {"M200 D: E is in mm³",
         "M200 D2.85\nM83\nG1 E1 F60\nM200 D0\nG1 E1\n",
         {"filament E0.156755 at 1", "filament E1.15675 at 1"}},
        {"M200 S switches, with the machine's own diameter",
         "M200 S1\nM83\nG1 E2.40528 F60\nM200 S0\nG1 E1\n",
         {"filament E0.999999 at 1", "filament E2 at 1"}},
        {"inches are cubic then",
         "G20\nM200 D0.11220472 S1\nM83\nG1 E.1 F60\n",
         {"filament E256.875 at 25.4"}},
        {"of a tool that is not there", "M200 T1 D2.85\nG1 E1 F60\n", {"filament E1 at 1"}},
        // 1.75 mm filament has 2.40528 mm²: 1.20264 mm³/s are 0.5 mm of it a second.
        {"M200 L: a move that prints is slowed down to its flow",
         "M200 L1.20264\nM83\nG1 X10 E1 F1200\nG1 X20 E.1\nG1 X30\nG1 E2\nM200 L0\nG1 X40 E1\n",
         {"print X10 E1 at 5", "print X20 E1.1 at 20", "travel X30 at 20", "filament E3.1 at 20",
          "print X40 E4.1 at 20"}},
        {"no filament is that thick",
         "M200 D100\n",
         {"error: line 1, M200: D100 is outside of 0.5 to 5 mm of diameter"}},
        {"M92 E calibrates what a millimetre is, also of a retraction",
         "M92 E96\nG1 E1 F60\nM92 E105.6\nG1 E2\nM207 S2 F600\nG10\n",
         {"filament E1 at 1", "filament E2.1 at 1", "filament E-0.1 at 10"}},
        {"M92 of the machine's own numbers", "M92 X80 Y80 Z2020\n", {}},
        {"M92 of another machine",
         "M92 X100\n",
         {"error: line 1, M92: X100 steps/mm are not this machine's 80 (steps_per_mm in its machine file)"}},
        {"M92 of another drive",
         "M92 E415\n",
         {"error: line 1, M92: E415 steps/mm are not this machine's 96 (steps_per_mm in its machine file)"}},
    });
}

TEST(Dialect, MachineWords) {
    check({
        {"speeds and accelerations",
         "SET_VELOCITY_LIMIT ACCEL=500 ACCEL_TO_DECEL=250\nSET_VELOCITY_LIMIT VELOCITY=5 "
         "SQUARE_CORNER_VELOCITY=3\nG1 X5 F6000\nG1 E1\n",
         {"limits print500 travel500", "limits jX3 jY3", "travel X5 at 5", "filament E1 at 100"}},
        {"heat",
         "SET_HEATER_TEMPERATURE HEATER=extruder TARGET=200\nSET_HEATER_TEMPERATURE HEATER=heater_bed "
         "TARGET=60\nTURN_OFF_HEATERS\nSET_HEATER_TEMPERATURE HEATER=chamber TARGET=40\n",
         {"set hot end 200", "set bed 60", "set hot end 0", "set bed 0",
          "error: line 4, SET_HEATER_TEMPERATURE: this machine has no heater chamber"}},
        {"M116 waits for what is set",
         "M140 S60\nM104 S200\nM116\n",
         {"set bed 60", "set hot end 200", "wait bed 60 heating", "wait hot end 200 heating"}},
        {"pauses", "M25\nM125\nM226\nPAUSE\n", {"pause []", "pause []", "pause []", "pause []"}},
        {"what cannot matter is named once a line",
         "SET_FAN_SPEED FAN=aux SPEED=1\nM300 S1\n",
         {"not done line 1: SET_FAN_SPEED (another fan) is not done by this printer: skipped",
          "not done line 2: M300 (beep) is not done by this printer: skipped"}},
    });
}

TEST(Dialect, WordsOfAStartMacro) {
    check({
        {"a temperature is waited for, and the target stays",
         "M104 S200\nTEMPERATURE_WAIT SENSOR=extruder MINIMUM=150\nM140 S60\n"
         "TEMPERATURE_WAIT SENSOR=heater_bed MINIMUM=50 MAXIMUM=65\n",
         {"set hot end 200", "wait hot end 200 from 150 to 1000", "set bed 60", "wait bed 60 from 50 to 65"}},
        {"cooling, too",
         "M140 S0\nTEMPERATURE_WAIT SENSOR=heater_bed MAXIMUM=30\n",
         {"set bed 0", "wait bed 0 from 0 to 30"}},
        {"what never comes is not waited for",
         "M104 S200\nTEMPERATURE_WAIT SENSOR=extruder MINIMUM=210\n"
         "TEMPERATURE_WAIT SENSOR=extruder MAXIMUM=190\nTEMPERATURE_WAIT SENSOR=heater_bed MAXIMUM=10\n"
         "TEMPERATURE_WAIT SENSOR=chamber MINIMUM=10\nTEMPERATURE_WAIT SENSOR=extruder\n",
         {"set hot end 200", "error: line 2, TEMPERATURE_WAIT: it would wait for ever: the target is 200 °C",
          "error: line 3, TEMPERATURE_WAIT: it would wait for ever: the target is 200 °C",
          "error: line 4, TEMPERATURE_WAIT: it would wait for ever: the target is 0 °C",
          "error: line 5, TEMPERATURE_WAIT: this machine has no heater chamber",
          "error: line 6, TEMPERATURE_WAIT: needs MINIMUM or MAXIMUM, a temperature"}},
        {"modes and coordinates come back",
         "G1 X20 Y20 E1 F600\nSAVE_GCODE_STATE NAME=a\nG91\nM83\nG92 X0 E0\nSET_GCODE_OFFSET Y=3\n"
         "M220 S50\nG1 X5 E1 F60\nRESTORE_GCODE_STATE NAME=a\nG1 X30 Y21 E2\n",
         {"print X20 Y20 E1 at 10", "factors 0.5 1", "print X25 E2 at 0.5", "factors 1 1",
          "print X30 Y21 E3 at 10"}},
        {"the place, where that is asked for",
         "G1 X20 Y20 Z1 F600\nSAVE_GCODE_STATE\nG91\nG1 X5\nRESTORE_GCODE_STATE MOVE=1 MOVE_SPEED=50\nG1 "
         "Z2\n",
         {"travel X20 Y20 Z1 at 10", "travel X25 at 10", "factors 1 1", "travel X20 at 50",
          "travel Z2 at 10"}},
        {"what was not saved",
         "RESTORE_GCODE_STATE NAME=b\n",
         {"error: line 1, RESTORE_GCODE_STATE: no state was saved as b"}},
        {"the objects' words that SuperSlicer had first",
         "DEFINE_OBJECT NAME=lid CENTER=50,59 POLYGON=[[44,53],[44,65]]\nEXCLUDE_OBJECT NAME=lid\n"
         "START_CURRENT_OBJECT NAME=lid\nG1 X9\nEND_CURRENT_OBJECT NAME=lid\n"
         "START_CURRENT_OBJECT NAME=box\nEND_CURRENT_OBJECT NAME=box\n",
         {"not done line 1: DEFINE_OBJECT (name an object) is not done by this printer: skipped"}},
        {"names of objects are the same in any case",
         "EXCLUDE_OBJECT NAME=lid\nEXCLUDE_OBJECT_START NAME=Lid\nG1 X9\nEXCLUDE_OBJECT_END NAME=LID\n",
         {}},
        {"a bed that nothing could have measured",
         "BED_MESH_PROFILE LOAD=default\n",
         {"not done line 1: BED_MESH_PROFILE (bed mesh) is not done by this printer: skipped"}},
    });
}

TEST(Dialect, WhatMayMoveAndIsNotUnderstoodIsRefused) {
    for (const char* line : {"X20", "Y1 F600", "E5", "A1", "T100", "T1000", "G53 X1", "G90.1", "G61",
                             "_MOVE X=1", "M808 L3", "M810 G1 X5", "M819", "M421 I0 J0 Z1", "M556 S100 X1",
                             "M579 X1.1", "M665 R100", "M666 X1", "M6 T1"}) {
        Bench bench;
        const auto log = bench.run(std::string(line) + "\n");
        ASSERT_EQ(log.size(), 1u) << line;
        EXPECT_EQ(log.front().rfind("error: line 1", 0), 0u) << line << ": " << log.front();
    }
}

TEST(Dialect, InputShapingAndPressureAdvance) {
    check({
        {"Marlin",
         "M593 F40 D0.15\nM593 X F0\nM900 K0.05\nM900\n",
         {"compensate X 40 Hz X damping 0.15 Y 40 Hz Y damping 0.15", "compensate X 0 Hz",
          "compensate advance 0.05"}},
        {"another law's factor",
         "M900 K30\nM900 K3\n",
         {"warning line 1: M900 K30 is a factor of Linear Advance 1.0: it changes nothing",
          "error: line 2, M900: K3 is outside of 0 to 2 s"}},
        {"RepRapFirmware",
         "M593 P\"mzv\" F38.5 S0.2\nM593 P\"none\"\nM572 D0 S0.04\nM572 D1 S0.3\n",
         {"compensate X type 3 X 38.5 Hz X damping 0.2 Y type 3 Y 38.5 Hz Y damping 0.2",
          "compensate X type 0 Y type 0", "compensate advance 0.04"}},
        {"Prusa's numbers",
         "M593 X T4 F55\nM593 Y T0 F30\n",
         {"compensate X type 5 X 55 Hz", "compensate Y type 1 Y 30 Hz"}},
        {"Klipper",
         "SET_INPUT_SHAPER SHAPER_TYPE=ei SHAPER_FREQ_X=40 DAMPING_RATIO_Y=0.2 SHAPER_TYPE_Y=2hump_ei\n"
         "SET_PRESSURE_ADVANCE ADVANCE=0.06 SMOOTH_TIME=0.03\nSET_PRESSURE_ADVANCE SMOOTH_TIME=0\n",
         {"compensate X type 4 X 40 Hz Y type 5 Y damping 0.2", "compensate advance 0.06 smooth 0.03",
          "compensate smooth 0.001"}},
        {"what is wrong is refused",
         "M593 F3\n",
         {"error: line 1, M593: a shaper of 3 Hz: give 0 (off), or 10 to 500 Hz"}},
        {"an unknown shaper",
         "M593 P\"zvdd\" F40\n",
         {"error: line 1, M593: no input shaper zvdd: this printer has ZV, ZVD, MZV, EI and 2HUMP_EI"}},
        {"a tool that is not there",
         "SET_PRESSURE_ADVANCE EXTRUDER=extruder1 ADVANCE=0.1\n",
         {"error: line 1, SET_PRESSURE_ADVANCE: this machine has one tool, T0"}},
    });
}

TEST(Dialect, ALongDefinitionOfAnObjectIsNoError) {
    Bench bench;
    (void)bench.run("G28\n");
    const std::string polygon(20'000, '1');
    const Log log = bench.run("EXCLUDE_OBJECT_DEFINE NAME=lid POLYGON=[[" + polygon + "]]\nG1 X1 F60\n" +
                              "UNKNOWN_WORD " + polygon + "\n");
    ASSERT_EQ(log.size(), 3U);
    EXPECT_EQ(log[0].rfind("not done line 1: EXCLUDE_OBJECT_DEFINE", 0), 0U) << log[0];
    EXPECT_EQ(log[1], "travel X1 at 1");
    EXPECT_NE(log[2].find("more than the 1024"), std::string::npos) << log[2];
}

// ---- curves -------------------------------------------------------------------------------------

TEST(Dialect, ASplineBeginsAndEndsAlongItsControlPoints) {
    Bench bench;
    (void)bench.run("G28\nG1 X10 Y10 F600\n");
    bench.recorder.moves.clear();
    (void)bench.run("G5 X30 Y10 I0 J10 P0 Q-10 E2\n");
    const std::vector<Move>& moves = bench.recorder.moves;
    ASSERT_GT(moves.size(), 10U);
    const auto slope = [](const Move& move) {
        return std::atan2((move.to[Axis::y] - move.from[Axis::y]).value(),
                          (move.to[Axis::x] - move.from[Axis::x]).value());
    };
    EXPECT_NEAR(slope(moves.front()), std::numbers::pi / 2, 0.1);
    EXPECT_NEAR(slope(moves.back()), std::numbers::pi / 2, 0.1) << "Q-10: it comes from below";
    EXPECT_EQ(moves.back().to[Axis::x].value(), 30);
    EXPECT_EQ(moves.back().to[Axis::e].value(), 2);
    // The middle of such an S is the middle between its ends.
    double nearest = 1e9;
    for (const Move& move : moves)
        nearest = std::min(nearest, std::hypot(move.to[Axis::x].value() - 20, move.to[Axis::y].value() - 10));
    EXPECT_LT(nearest, 0.6);
    EXPECT_EQ(bench.run("G5 X30 Y10 I0 J10\n").front(), "error: line 1, G5: a spline needs I, J, P and Q");
    EXPECT_EQ(bench.run("G18\nG5 X30 Y10 I0 J10 P0 Q0\n").front(),
              "error: line 2, G5: a spline lies in the XY plane (G17)");
}

TEST(Dialect, ArcsTakeTheCentreOfTheirPlane) {
    Bench bench;
    (void)bench.run("G28\nG1 X50 Y50 Z50 F600\n");
    EXPECT_EQ(bench.run("G18\nG2 X60 Z50 I5 J3\n").front(),
              "error: line 2, G2: J is no centre in this plane");
    EXPECT_EQ(bench.run("G19\nG2 Y60 Z50\n").front(), "error: line 2, G2: an arc needs a centre: J, K or R");
    bench.recorder.moves.clear();
    // Seen from +Y, from Z to X: G3 from (z 50, x 50) about (z 50, x 55) goes down in Z first.
    (void)bench.run("G18\nG3 X60 Z50 I5 K0\n");
    ASSERT_GT(bench.recorder.moves.size(), 4U);
    EXPECT_LT(bench.recorder.moves[0].to[Axis::x].value(), 50.5);
    EXPECT_GT(bench.recorder.moves[0].to[Axis::z].value(), 50);
    EXPECT_EQ(bench.recorder.moves.back().to[Axis::x].value(), 60);
}

// ---- macros -------------------------------------------------------------------------------------

MachineConfig with_macros() {
    MachineConfig machine;
    machine.macros.push_back({"PRINT_START", "G28 ; home\nM190 S{BED}\nM109 S{extruder=200}\n"});
    machine.macros.push_back({"TWICE", "PRINT_START BED=50\n"});
    machine.macros.push_back({"ARCS", "G3 X30 Y10 I10\nG1 X5"});
    machine.macros.push_back({"PAUSE", "M117 mine"});
    machine.macros.push_back({"BROKEN", "G1 X{PLACE"});
    return machine;
}

TEST(Dialect, MacrosStandForTheirLines) {
    check(
        {
            {"with parameters in any case",
             "print_start bed=60 EXTRUDER=\"210\"\n",
             {"home XYZ", "wait bed 60 heating", "wait hot end 210 heating"}},
            {"with a default",
             "PRINT_START BED=60\n",
             {"home XYZ", "wait bed 60 heating", "wait hot end 200 heating"}},
            {"without a parameter that it needs",
             "PRINT_START\n",
             {"error: line 1, PRINT_START: PRINT_START needs BED=…"}},
            {"with a value that its line refuses",
             "PRINT_START BED=999\n",
             {"home XYZ",
              "error: line 1, PRINT_START: M190: S999 is outside of 0 to 110 °C, what the bed may have"}},
            {"a macro calls none",
             "TWICE\n",
             {"error: line 1, TWICE: PRINT_START: a macro of the machine file calls no macro"}},
            {"a macro goes before a word of the table", "PAUSE\n", {"message [mine]"}},
            {"a brace without its other half",
             "BROKEN\n",
             {"error: line 1, BROKEN: BROKEN: a { without its }"}},
        },
        with_macros());
}

TEST(Dialect, AMacroIsCarriedOutALineAtATime) {
    Bench bench{with_macros()};
    (void)bench.run("G28\nG1 X10 Y10 F600\n");
    bench.recorder.moves.clear();
    const auto command = parse_line("ARCS");
    ASSERT_TRUE(command.ok());
    ASSERT_TRUE(bench.interpreter.execute(**command, 4).ok());
    EXPECT_TRUE(bench.interpreter.pending());
    EXPECT_EQ(bench.recorder.moves.size(), 0U);
    ASSERT_TRUE(bench.interpreter.proceed(4).ok());
    EXPECT_EQ(bench.recorder.moves.size(), 4U) << "of the arc's chords no more at once";
    while (bench.interpreter.pending()) ASSERT_TRUE(bench.interpreter.proceed(4).ok());
    EXPECT_EQ(bench.recorder.moves.back().to[Axis::x].value(), 5);
}

// ---- whose meaning G90 and G91 have -------------------------------------------------------------

constexpr const char* kLayerScript = "M83\nG1 X5 E1 F60\nG91\nG1 Z1\nG90\nG1 X9 E1\n";

TEST(Dialect, EStaysRelativeAtG90WhereTheFileIsOfAFirmwareThatMeansItSo) {
    check({
        {"Marlin's",
         kLayerScript,
         {"print X5 E1 at 1", "travel Z1 at 1",
          "warning line 6: E is absolute here: the G90 before it has ended M83, as Marlin means it",
          "travel X9 at 1"}},
        {"M83 behind the G90 leaves nothing to ask",
         "M83\nG1 E1 F60\nG91\nG90\nM83\nG1 E1\n",
         {"filament E1 at 1", "filament E2 at 1"}},
        {"G91 ends with the G90 that it came with",
         "G91\nG1 E1 F60\nG90\nG1 E3\n",
         {"filament E1 at 1", "filament E3 at 1"}},
    });
    for (const char* sign :
         {"SET_VELOCITY_LIMIT VELOCITY=99", "EXCLUDE_OBJECT_END", "; gcode_flavor = klipper"}) {
        Bench bench;
        (void)bench.run(std::string{sign} + "\nG28\n");
        EXPECT_EQ(bench.run(kLayerScript),
                  (Log{"print X5 E1 at 1", "travel Z1 at 1",
                       "warning line 6: E stays relative at G90, as Klipper means it (line 1)",
                       "print X9 E2 at 1"}))
            << sign;
    }
    for (const char* sign : {"M572 D0 S0", "M566 X600", ";FLAVOR:RepRap", "; gcode_flavor = reprapfirmware",
                             "M862.3 P \"MK3S\"", "; printer_model = MK3SMMU2S"}) {
        Bench bench;
        (void)bench.run(std::string{sign} + "\nG28\n");
        EXPECT_EQ(bench.run(kLayerScript).back(), "print X9 E2 at 1") << sign;
    }
    for (const char* no_sign : {";FLAVOR:Marlin", "; gcode_flavor = marlin2", "M486 S-1", "M900 K0", "Tx",
                                "T?", "M862.3 P \"MK3.5\"", "; printer_model = MK4S", "M862.1 P0.4"}) {
        Bench bench;
        (void)bench.run(std::string{no_sign} + "\nG28\n");
        EXPECT_EQ(bench.run(kLayerScript).back(), "travel X9 at 1") << no_sign;
    }
}

/// End codes draw filament back so, whatever firmware they are for.
TEST(Dialect, InG91ECountsOnInAllOfThem) {
    for (const char* sign : {";", "; gcode_flavor = klipper", "M572 S0"}) {
        Bench bench;
        const Log log =
            bench.run(std::string{sign} + "\nG28\nM82\nG1 X5 E10 F60\nG91\nG1 E-2\nG90\nG1 X6 E9\n");
        ASSERT_GE(log.size(), 2U);
        EXPECT_EQ(Log(log.end() - 2, log.end()), (Log{"filament E8 at 1", "print X6 E9 at 1"})) << sign;
    }
}

TEST(Dialect, TheMachineFileMaySayItOnceAndForAll) {
    MachineConfig machine;
    machine.dialect = Dialect::klipper;
    Bench bench{machine};
    (void)bench.run("G28\n");
    EXPECT_EQ(bench.run(kLayerScript),
              (Log{"print X5 E1 at 1", "travel Z1 at 1",
                   "warning line 6: E stays relative at G90, as Klipper means it (machine file)",
                   "print X9 E2 at 1"}));
    machine.dialect = Dialect::marlin;
    Bench marlin{machine};
    (void)marlin.run("SET_VELOCITY_LIMIT VELOCITY=99\nG28\n");
    EXPECT_EQ(marlin.run(kLayerScript).back(), "travel X9 at 1");
}

/// What has been read in one way cannot be read again.
TEST(Dialect, ASignThatComesTooLateIsAnError) {
    Bench bench;
    (void)bench.run("G28\n");
    const Log log = bench.run(std::string{kLayerScript} + "SET_VELOCITY_LIMIT VELOCITY=99\nG1 X10 E1\n");
    ASSERT_GE(log.size(), 2U);
    EXPECT_EQ(
        log[log.size() - 2],
        "error: line 7: this file is Klipper's, where G90 and G91 leave E alone; the E of line 6 was read as "
        "Marlin would: write M82 or M83 before that line");
    EXPECT_EQ(log.back(), "print X10 E2 at 1");
    // Nothing was read that means something else.
    EXPECT_EQ(bench.run("M83\nG1 X11 E1\n"), Log{"print X11 E3 at 1"});
    Bench fine;
    (void)fine.run("G28\n");
    EXPECT_EQ(
        fine.run("M83\nG90\nM83\nG1 X5 E1 F60\nG91\nG1 E1\nG90\nSET_VELOCITY_LIMIT VELOCITY=99\nG1 X9 E1\n")
            .back(),
        "print X9 E3 at 1");
    bench.interpreter.reset_modes();
    EXPECT_EQ(bench.interpreter.state().dialect, Dialect::marlin) << "the next job says it for itself";
}

// ---- objects ------------------------------------------------------------------------------------

TEST(Dialect, AnObjectThatIsLeftOutMovesNothing) {
    check({
        {"Klipper's words: the head waits, then goes straight to the next place",
         "G1 X10 Y10 Z1 F60\nEXCLUDE_OBJECT NAME=lid\nEXCLUDE_OBJECT_START NAME=lid\nG1 X20 Y20\nM83\n"
         "G1 X30 E5\nEXCLUDE_OBJECT_END NAME=lid\nG1 X50 Y50\nG1 X60 E1\n",
         {"travel X10 Y10 Z1 at 1", "travel X50 Y50 at 1", "print X60 E1 at 1"}},
        {"up first, down last",
         "M486 P3\nG1 X10 Z1 F60\nM486 S3\nG1 X20 Z2\nM486 S-1\nG1 X30\nM486 S3\nG1 Z0.5\nM486 S4\nG1 X40\n",
         {"travel X10 Z1 at 1", "travel Z2 at 1", "travel X30 at 1", "travel X40 at 1", "travel Z0.5 at 1"}},
        {"other objects are printed",
         "EXCLUDE_OBJECT NAME=a\nEXCLUDE_OBJECT_START NAME=b\nG1 X5 F60\nEXCLUDE_OBJECT_END\n",
         {"travel X5 at 1"}},
        {"this one, from here on",
         "EXCLUDE_OBJECT_START NAME=a\nG1 X5 F60\nEXCLUDE_OBJECT CURRENT=1\nG1 X6\n",
         {"travel X5 at 1"}},
        {"M486 C and U",
         "M486 S0\nG1 X5 F60\nM486 C\nG1 X6\nM486 U0\nG1 X7\n",
         {"travel X5 at 1", "travel X7 at 1"}},
        {"a name's letters are no parameters",
         "M486 S0 \nM486 ACup 0 P0\nG1 X5 F60\nM486 S0 A\"P0\"\nG1 X6\n",
         {"travel X5 at 1", "travel X6 at 1"}},
        {"in Marlin's order",
         "M486 S0\nM486 C U0\nG1 X5 F60\nM486 P1 U1\nM486 S1\nG1 X6\nM486 S2 C P1\nG1 X7\nM486 S1\nG1 X8\n",
         {"travel X5 at 1", "travel X6 at 1"}},
        {"a label that is none",
         "M486 P\nM486 S10000\n",
         {"error: line 1, M486: P needs a number behind it",
          "error: line 2, M486: S10000 is outside of -9999 to 9999"}},
        {"everything again",
         "EXCLUDE_OBJECT NAME=a\nEXCLUDE_OBJECT RESET=1\nEXCLUDE_OBJECT_START NAME=a\nG1 X5 F60\n",
         {"travel X5 at 1"}},
        {"what is not there to be left out",
         "EXCLUDE_OBJECT CURRENT=1\n",
         {"error: line 1, EXCLUDE_OBJECT: no object is being printed"}},
        {"it waits on until a line goes sideways, but goes up and draws filament back at once",
         "M486 P0\nM486 S0\nG1 X20 Y20 F60\nM486 S-1\nG1 Z1\nG1 E-1\nG1 X5\n",
         {"travel Z1 at 1", "filament E-1 at 1", "travel X5 Y20 at 1"}},
        {"what moves nothing leaves nothing out, and the head does not wait behind it",
         "M83\nG1 X5 F60\nM486 S0 C\nG1\nG1 X5 E0\nM486 S-1\nG1 X5 E2\n",
         {"travel X5 at 1", "filament E2 at 1"}},
        {"filament is drawn back as far as the program takes it to be",
         "M83\nM486 P0\nG1 X1 E5 F60\nM486 S0\nG1 X2 E1\nG1 E-2\nM486 S-1\nG1 X3\nG1 E2\nG1 X4 E1\n",
         {"print X1 E5 at 1", "filament E3 at 45", "travel X3 at 1", "filament E5 at 1", "print X4 E6 at 1"}},
        {"… or pushed again",
         "M83\nM486 P0\nG1 X1 E5 F60\nG1 E-2\nM486 S0\nG1 E2\nG1 X2 E1\nM486 S-1\nG1 X3\nG1 X4 E1\n",
         {"print X1 E5 at 1", "filament E3 at 1", "travel X3 at 1", "filament E5 at 8", "print X4 E6 at 1"}},
        {"… or before a homing, which ends the wait",
         "M83\nM486 P0\nG1 X1 E5 F60\nG1 E-2\nM486 S0\nG1 E2\nG1 X2 E1\nM486 S-1\nG28 X\nG1 X4 E1\n",
         {"print X1 E5 at 1", "filament E3 at 1", "filament E5 at 8", "home X", "print X4 E6 at 1"}},
        {"… where it is drawn back as well",
         "M83\nM486 P0\nG1 X1 E5 F60\nM486 S0\nG1 X2 E1\nG1 E-2\nG28 X\nM486 S-1\nG1 X3\nG1 E2\n",
         {"print X1 E5 at 1", "filament E3 at 45", "home X", "travel X3 at 1", "filament E5 at 1"}},
    });
}

/// An end code may lift without going sideways. Each of these comes behind the last object, which
/// is left out at Z0.3: the head must not stay in the part, or be dragged through it.
TEST(Dialect, WhatStandsBehindTheLastObjectTakesTheHeadOutOfThePart) {
    const std::string begin = "G1 X30 Y30 F6000\nG1 Z0.3 F300\nM83\n";
    struct End {
        const char* name;
        const char* program;
        Log expected;
    };
    for (const char* labels :
         {"EXCLUDE_OBJECT NAME=a\nEXCLUDE_OBJECT_START NAME=a\nG1 X50 E1\nEXCLUDE_OBJECT_END NAME=a\n",
          "M486 P1\nM486 S1\nG1 X50 E1\nM486 S-1\n", "M486 S1\nM486 C\nG1 X50 E1\nM486 S-1\n"}) {
        for (const End& end : std::initializer_list<End>{
                 {"a lift, then homing", "G91\nG1 Z10\nG90\nG28 X0 Y0\n", {"travel Z10.3 at 5", "home XY"}},
                 {"a lift, then motors off", "G91\nG1 Z10\nG90\nM84\n", {"travel Z10.3 at 5", "off XYZE"}},
                 {"a lift alone", "G1 Z10\n", {"travel Z10 at 5"}},
                 {"a retraction, then a lift",
                  "G1 E-2 F1800\nG1 Z10\n",
                  {"filament E-2 at 30", "travel Z10 at 30"}},
                 {"both in one", "G1 Z10 E-2\n", {"filament E-2 at 5", "travel Z10 at 5"}},
                 {"by an offset", "SET_GCODE_OFFSET Z=5 MOVE=1\n", {"travel Z5.3 at 5"}},
                 {"a way down is owed until the head is there",
                  "G1 Z10\nG1 Z2\nG1 X5\n",
                  {"travel Z10 at 5", "travel X5 at 5", "travel Z2 at 5"}},
                 {"a wait behind it", "G1 Z10\nG4 S1\n", {"travel Z10 at 5", "dwell 1"}}}) {
            Bench bench;
            (void)bench.run("G28\n" + begin);
            EXPECT_EQ(bench.run(labels + std::string{end.program}), end.expected) << end.name << "\n"
                                                                                  << labels;
        }
    }
}

/// The object itself may be what goes up: the program is at its top then, the head below.
TEST(Dialect, AHeadThatWaitsBelowTheProgramGoesUpBeforeItIsTakenElsewhere) {
    const std::string cut = "G1 Z0.3 F300\nM83\nM486 S1 C\nG1 X50 E1\nG1 Z20\nG1 E-2\nM486 S-1\n";
    for (const auto& [program, expected] : std::initializer_list<std::pair<const char*, Log>>{
             {"G28 X Y\n", {"filament E-2 at 45", "travel Z20 at 5", "home XY"}},
             {"M84\n", {"filament E-2 at 45", "travel Z20 at 5", "off XYZE"}},
             {"M84 E\n", {"off E"}},
             {"M84 S60\n", {"off after 60"}},
             {"", {}}}) {
        Bench bench;
        (void)bench.run("G28\n");
        const Log log = bench.run(cut + program);
        ASSERT_GE(log.size(), 1U);
        EXPECT_EQ(Log(log.begin() + 1, log.end()), expected) << program;
        bench.recorder.moves.clear();
        ASSERT_TRUE(bench.interpreter.finish().ok());
        const bool left = program[0] == 'G' || std::string{program} == "M84\n";
        EXPECT_EQ(bench.recorder.moves.size(), left ? 0U : 2U) << "at the end: " << program;
        EXPECT_EQ(bench.interpreter.state().machine[Axis::z].value(), 20) << program;
    }
}

/// X is homed, and Y is owed: the next line goes to the program's Y.
TEST(Dialect, AHomingGivesAHeadThatWaitsTheAxesThatItHomes) {
    Bench bench;
    (void)bench.run("G28\nG1 X30 Y30 Z1 F300\nM486 S1 C\nG1 X50 Y60 Z2\nM486 S-1\n");
    EXPECT_EQ(bench.run("G28 X\n"), (Log{"travel Z2 at 5", "home X"}));
    Position found = bench.interpreter.state().machine;
    EXPECT_EQ(found[Axis::y].value(), 60) << "by the program";
    found[Axis::x] = 0_mm;
    found[Axis::y] = 30_mm;
    bench.interpreter.set_position(found);
    EXPECT_EQ(bench.run("G1 X10\n"), (Log{"travel X10 Y60 at 5"}));
}

/// What tells two objects apart may stand at any place of their names.
TEST(Dialect, ObjectsAreToldApartByTheirWholeNames) {
    const std::string long_name(180, 'x');
    for (const auto& [left_out, printed] : std::vector<std::pair<std::string, std::string>>{
             {long_name + "_copy_0", long_name + "_copy_1"},
             {"Ultimate Box 1", "Ultimate Box 2"},
             {"'Bob's part 1'", "'Bob's part 2'"},
             {"\"12\" lid\"", "\"12\" cup\""},
             {"\"a;b\"", "\"a;c\""},
             {"A=B x=1", "A=B x=2"},
             {"\xE6\x96\xB0\xE7\x89\x88 1", "\xE6\x96\xB0\xE7\x89\x88 2"},
             {"test\xFC", "test\xF6"},
             {"a\tb", "a\tc"},
             {std::string(24, 'n') + "\xE7\x9B\x92", std::string(24, 'n') + "\xE7\x9B\x93"}}) {
        Bench bench;
        (void)bench.run("G28\nG1 F60\nEXCLUDE_OBJECT NAME=" + left_out + "\n");
        EXPECT_EQ(bench.run("EXCLUDE_OBJECT_START NAME=" + left_out + "\nG1 X9\nEXCLUDE_OBJECT_END NAME=" +
                            left_out + "\nEXCLUDE_OBJECT_START NAME=" + printed + "\nG1 X7\n"),
                  Log{"travel X7 at 1"})
            << left_out;
    }
    check({
        {"with quotes and without, with other keys behind it, in any case",
         "EXCLUDE_OBJECT NAME=\"My lid 1\"\nEXCLUDE_OBJECT_START NAME=my LID 1 CENTER=1,2\nG1 X9\n",
         {}},
        {"and printed after all",
         "EXCLUDE_OBJECT NAME=My lid\nEXCLUDE_OBJECT RESET=1 NAME=my lid\nEXCLUDE_OBJECT_START NAME=my lid\n"
         "G1 X9 F60\n",
         {"travel X9 at 1"}},
        {"or with the other order",
         "EXCLUDE_OBJECT NAME=My lid\nEXCLUDE_OBJECT NAME=my lid RESET=1\nEXCLUDE_OBJECT_START NAME=my lid\n"
         "G1 X9 F60\n",
         {"travel X9 at 1"}},
    });
    const std::string too_long = "EXCLUDE_OBJECT_START NAME=" + std::string(300, 'x') + "\n";
    check(
        {{"a name that would be cut is refused",
          too_long.c_str(),
          {"error: line 1, EXCLUDE_OBJECT_START: what follows it is longer than the 256 bytes that may: the "
           "rest would be lost"}}});
}

TEST(Dialect, AThousandObjectsMayBeLeftOut) {
    Bench bench;
    std::string program = "G28\n";
    for (int i = 0; i < 1024; ++i) program += "M486 P" + std::to_string(i) + "\n";
    EXPECT_EQ(bench.run(program), Log{"home XYZ"});
    EXPECT_EQ(bench.run("M486 P1024\n"),
              Log{"error: line 1, M486: more than 1024 objects cannot be left out"});
    EXPECT_EQ(bench.run("M486 S1023\nG1 X9 F60\nM486 U1023\nG1 X8\n"), Log{"travel X8 at 1"});
}

TEST(Dialect, SavedStatesAreToldApartByTheirWholeNames) {
    const std::string same(40, 's');
    const std::string program = "G91\nSAVE_GCODE_STATE NAME=" + same +
                                "1\nG90\nSAVE_GCODE_STATE NAME=" + same +
                                "2\nRESTORE_GCODE_STATE NAME=" + same +
                                "1 MOVE=0\nG1 X5 F60\nG1 X5\n"
                                "SAVE_GCODE_STATE NAME=my state a\nG90\nSAVE_GCODE_STATE NAME=my state b\n"
                                "RESTORE_GCODE_STATE NAME=my state a\nG1 X5\n";
    check({{"to the last byte, and past a blank",
            program.c_str(),
            {"factors 1 1", "travel X5 at 1", "travel X10 at 1", "factors 1 1", "travel X15 at 1"}}});
}

/// A homing tells the interpreter where the head stands, to the step. That moves no filament.
TEST(Dialect, FilamentStaysDrawnBackWhereTheHeadIsFoundAnew) {
    Bench bench;
    (void)bench.run("G28\nM83\nG1 X1 E5 F60\nG1 E-2\nG28 X\n");
    Position found = bench.interpreter.state().machine;
    found[Axis::e] += Millimetres{0.25};
    bench.interpreter.set_position(found);
    EXPECT_EQ(bench.run("M486 S0 C\nG1 X2 E1\nM486 S1\nG1 X3\n"),
              (Log{"travel X3 at 1", "filament E4.25 at 8"}))
        << "of 2 mm the program takes 1 to be drawn back";
}

}  // namespace
}  // namespace qduino::printer::gcode::interpreter_dialect_test
