// Codes that move, and codes that change how moves are read: a program in, the actions that it asks
// for out.
#include "printer/gcode/interpreter.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "recorder.h"

namespace qduino::printer::gcode::interpreter_test {
namespace {

using Log = std::vector<std::string>;

struct Case {
    const char* name;
    const char* program;
    Log expected;
};

/// Every program begins at the home position, homed, so that no warning of unhomed axes stands in
/// the way.
void check(const Case& c) {
    Bench bench;
    (void)bench.run("G28\n");
    EXPECT_EQ(bench.run(c.program), c.expected) << c.name;
}

TEST(Interpreter, Moves) {
    const Case cases[] = {
        {"the speed is per minute in the program and per second after",
         "G1 X10 F600\n",
         {"travel X10 at 10"}},
        {"the speed is modal", "G1 X10 F600\nG0 Y5\n", {"travel X10 at 10", "travel Y5 at 10"}},
        {"the speed at start is Marlin's", "G0 X1\n", {"travel X1 at 25"}},
        {"F alone moves nothing", "G1 F1200\nG1 X1\n", {"travel X1 at 20"}},
        {"F0 says nothing", "G1 F600\nG1 X1 F0\n", {"travel X1 at 10"}},
        {"with filament it is a print", "G1 X10 E1 F60\n", {"print X10 E1 at 1"}},
        {"filament alone", "G1 E-0.8 F2400\n", {"filament E-0.8 at 40"}},
        {"a move to where it stands is none", "G1 X0 Y0\nG1 E0\nG1\n", {}},
        {"absent axes stay", "G1 X10 Y10 F60\nG1 Z5\n", {"travel X10 Y10 at 1", "travel Z5 at 1"}},
        {"no spaces, lower case", "g1x10y2f60\n", {"travel X10 Y2 at 1"}},
        {"bounds are inclusive", "G1 X150 Y150 Z150 F60\n", {"travel X150 Y150 Z150 at 1"}},
    };
    for (const Case& c : cases) check(c);
}

TEST(Interpreter, Modes) {
    const Case cases[] = {
        {"inches scale axes, filament and speed", "G20\nG1 X1 E.1 F60\n", {"print X25.4 E2.54 at 25.4"}},
        {"millimetres come back", "G20\nG21\nG1 X1 F60\n", {"travel X1 at 1"}},
        {"relative",
         "G91\nG1 X10 F60\nG1 X10\nG1 X-5\n",
         {"travel X10 at 1", "travel X20 at 1", "travel X15 at 1"}},
        {"G91 makes E relative too", "G91\nG1 E1 F60\nG1 E1\n", {"filament E1 at 1", "filament E2 at 1"}},
        {"G90 makes E absolute again",
         "G91\nG1 E1 F60\nG90\nG1 E1.5\n",
         {"filament E1 at 1", "filament E1.5 at 1"}},
        {"M83 makes E alone relative",
         "M83\nG1 X10 E1 F60\nG1 X20 E1\n",
         {"print X10 E1 at 1", "print X20 E2 at 1"}},
        {"M82 after G91 keeps X relative",
         "G91\nM82\nG1 X10 E1 F60\nG1 X10 E2\n",
         {"print X10 E1 at 1", "print X20 E2 at 1"}},
    };
    for (const Case& c : cases) check(c);
}

TEST(Interpreter, SetPosition) {
    const Case cases[] = {
        {"G92 E0 moves nothing and counts anew",
         "G1 E5 F60\nG92 E0\nG1 E1\n",
         {"filament E5 at 1", "filament E6 at 1"}},
        {"G92 X moves the program, not the machine",
         "G1 X50 F60\nG92 X0\nG1 X10\nG1 X-10\n",
         {"travel X50 at 1", "travel X60 at 1", "travel X40 at 1"}},
        {"bounds are the machine's whatever G92 says",
         "G1 X140 F60\nG92 X0\nG1 X20\n",
         {"travel X140 at 1",
          "error: line 3, G1: X would go to 160 mm; this machine reaches from 0 to 150 mm"}},
        {"G92 without axes zeroes all",
         "G1 X50 Y40 E1 F60\nG92\nG1 X1 Y1 E1\n",
         {"print X50 Y40 E1 at 1", "print X51 Y41 E2 at 1"}},
        {"G92.1 goes back to the machine's coordinates",
         "G1 X50 F60\nG92 X0\nG92.1\nG1 X10\n",
         {"travel X50 at 1", "travel X10 at 1"}},
        {"G28 takes its axes out of the offset",
         "G1 X50 Y50 F60\nG92 X0 Y0\nG28 X\nG1 X1 Y1\n",
         {"travel X50 Y50 at 1", "home X", "travel X1 Y51 at 1"}},
        {"in inches", "G1 X50.8 F60\nG20\nG92 X1\nG1 X2\n", {"travel X50.8 at 1", "travel X76.2 at 1"}},
    };
    for (const Case& c : cases) check(c);
}

TEST(Interpreter, Factors) {
    const Case cases[] = {
        {"M220 scales the speed that is handed on, not the one that is kept",
         "G1 X1 F600\nM220 S200\nG1 X2\nM220 S100\nG1 X3\n",
         {"travel X1 at 10", "factors 2 1", "travel X2 at 20", "factors 1 1", "travel X3 at 10"}},
        {"M220 B keeps, R restores",
         "M220 S50\nM220 B\nM220 S200\nM220 R\nG1 X1 F600\n",
         {"factors 0.5 1", "factors 0.5 1", "factors 2 1", "factors 0.5 1", "travel X1 at 5"}},
        {"M221 scales filament from here on, the program's count does not",
         "G1 X1 E1 F60\nM221 S50\nG1 X2 E2\nM221 S100\nG1 X3 E3\n",
         {"print X1 E1 at 1", "factors 1 0.5", "print X2 E1.5 at 1", "factors 1 1", "print X3 E2.5 at 1"}},
        {"limits of M220",
         "M220 S0\nM220 S1001\n",
         {"error: line 1, M220: S0 is outside of 1 to 1000 percent",
          "error: line 2, M220: S1001 is outside of 1 to 1000 percent"}},
    };
    for (const Case& c : cases) check(c);
}

TEST(Interpreter, Retraction) {
    const Case cases[] = {
        {"G10 draws back, G11 pushes as much, the program's E is untouched",
         "G1 X10 E5 F60\nG10\nG1 X20\nG11\nG1 X30 E6\n",
         {"print X10 E5 at 1", "filament E2 at 45", "travel X20 at 1", "filament E5 at 8",
          "print X30 E6 at 1"}},
        {"twice is once",
         "G1 E5 F60\nG10\nG10\nG11\nG11\n",
         {"filament E5 at 1", "filament E2 at 45", "filament E5 at 8"}},
        {"with lift, and extra on recovery",
         "M207 S1 F1200 Z.4\nM208 S.1 F600\nG1 Z1 E5 F60\nG10\nG1 X10\nG11\nG1 Z2\n",
         {"print Z1 E5 at 1", "filament E4 at 20", "travel Z1.4 at 5", "travel X10 at 1", "travel Z1 at 5",
          "filament E5.1 at 10", "travel Z2 at 1"}},
        {"the lift stays while the program sets Z",
         "M207 S1 Z.5\nG1 Z1 F60\nG10\nG1 Z2\nG11\n",
         {"travel Z1 at 1", "filament E-1 at 45", "travel Z1.5 at 5", "travel Z2.5 at 1", "travel Z2 at 5",
          "filament E0 at 8"}},
        {"the length in force when it was drawn back counts",
         "M207 S2\nG1 E5 F60\nG10\nM207 S1\nG11\n",
         {"filament E5 at 1", "filament E3 at 45", "filament E5 at 8"}},
        {"a lift beyond the bounds is refused before anything moves",
         "M207 S1 Z1\nG1 Z149.5 F60\nG10\nG1 X1\n",
         {"travel Z149.5 at 1",
          "error: line 3, G10: Z would go to 150.5 mm; this machine reaches from 0 to 150 mm",
          "travel X1 at 1"}},
        {"G10 with a tool's number is no retraction", "G10 P0 R170\nG11\n", {}},
        {"… and this machine's tool has no offset",
         "G10 P0 X20\n",
         {"error: line 1, G10: this machine has one tool, which stands at no offset"}},
    };
    for (const Case& c : cases) check(c);
}

TEST(Interpreter, DwellHomeAndTools) {
    const Case cases[] = {
        {"G4 in seconds and milliseconds",
         "G4 S2\nG4 P500\nG4 S0\nG4\nM400\n",
         {"dwell 2", "dwell 0.5", "dwell 0", "dwell 0", "dwell 0"}},
        {"G4 out of range",
         "G4 S-1\nG4 S1000000\n",
         {"error: line 1, G4: S-1 is outside of 0 to 86400 s",
          "error: line 2, G4: S1000000 is outside of 0 to 86400 s"}},
        {"G28 all, some, and with Prusa's flags",
         "G28\nG28 X0\nG28 X Y\nG28 W\n",
         {"home XYZ", "home X", "home XY", "home XYZ"}},
        {"G28 O homes what this job has not homed",
         "G28 O\nM84 X\nG28 O Y\nG28 O Y\nG28 X\nG28 O\n",
         {"off X", "home Y", "home Y", "home X"}},
        {"T0 is the tool, others are not there",
         "T0\nT1\n",
         {"error: line 2, T1: this machine has one tool, T0"}},
        {"G17 is the only plane", "G17\n", {}},
    };
    for (const Case& c : cases) check(c);
}

TEST(Interpreter, EveryBadMoveIsAnErrorThatSaysWhyAndMovesNothing) {
    struct Bad {
        const char *line, *error;
    };
    const Bad cases[] = {
        {"G1 X151", "G1: X would go to 151 mm; this machine reaches from 0 to 150 mm"},
        {"G1 X-0.01", "G1: X would go to -0.01 mm"},
        {"G0 Y1000", "G0: Y would go to 1000 mm"},
        {"G1 Z-1", "G1: Z would go to -1 mm"},
        {"G1 X1 Y1 Z151", "Z would go to 151 mm"},
        {"G1 X99999999999999999999", "X would go to 1e+20 mm"},
        {"G1 X", "X needs a number"},
        {"G1 X10 F", "F needs a number"},
        {"G1 X10 F-5", "F, a speed, is below 0"},
        {"G1 X10 A5", "this code takes no A here, only XYZEFSH"},
        {"G1 X10 S1", "S1 asks for a move that ends at a switch"},
        {"G1 X10 H1", "H1 asks for a move that ends at a switch"},
        {"G1 X1 E1001", "E1001 is outside of -1000 to 1000 mm in one move"},
        {"G1 E-1001", "E-1001 is outside"},
        {"G2 X10 Y10", "an arc needs a centre"},
        {"G2 X10 I5 R5", "I and J, or R, not both"},
        {"G2 X10 Y0 R4", "R is too small"},
        {"G3 R5", "an arc with R needs an end that differs"},
        {"G2 X10 Y10 I3 J4", "the ends of the arc are 5.000 and 9.220 mm from its centre"},
        // Both ends are inside, the half circle between them is not.
        {"G3 X10 I5", "Y would go to -"},
        {"G92 X2000000", "X2000000 is outside"},
        {"G92 Q1", "takes no Q"},
        {"G92.1 X1", "takes no X"},
    };
    for (const Bad& c : cases) {
        Bench bench;
        (void)bench.run("G28\n");
        const ModalState before = bench.interpreter.state();
        const Log log = bench.run(std::string(c.line) + "\n");
        ASSERT_EQ(log.size(), 1U) << c.line;
        EXPECT_EQ(log[0].rfind("error: line 1, ", 0), 0U) << log[0];
        EXPECT_NE(log[0].find(c.error), std::string::npos) << log[0];
        EXPECT_TRUE(bench.recorder.moves.empty()) << c.line;
        EXPECT_EQ(bench.interpreter.state().machine, before.machine) << c.line;
    }
}

TEST(Interpreter, AnErrorLeavesTheModalStateAsItWas) {
    Bench bench;
    (void)bench.run("G28\nG1 X10 E1 F600\n");
    // The speed comes first on the line, the bound is broken after it was read.
    (void)bench.run("G1 F6000 X200 E9\n");
    EXPECT_EQ(bench.interpreter.state().feedrate.value(), 10);
    EXPECT_EQ(bench.interpreter.state().programmed_e.value(), 1);
    // G92 sets X, then fails at Y.
    (void)bench.run("G92 X0 Y2000000\n");
    EXPECT_EQ(bench.interpreter.state().offset[Axis::x].value(), 0);
    (void)bench.run("M207 S9 F0\n");
    EXPECT_EQ(bench.interpreter.state().retraction.length.value(), 3);
    EXPECT_EQ(bench.run("G1 X20\n"), Log{"travel X20 at 10"});
}

TEST(Interpreter, ARefusedMoveLeavesTheStateAsItWas) {
    Bench bench;
    (void)bench.run("G28\n");
    bench.recorder.refuse_after = 0;
    EXPECT_EQ(bench.run("G1 X10 E1 F600\n"), Log{"error: line 1, G1: the machine refuses"});
    EXPECT_EQ(bench.interpreter.state().feedrate.value(), 25);
    EXPECT_EQ(bench.run("G1 X1 E1 F60\n"), Log{"print X1 E1 at 1"});
}

TEST(Interpreter, AHeadThatWaitsGoesOnWaitingWhenALineIsRefused) {
    // After each of these lines the head waits at X1, and the program is at X9 with E5 left out.
    for (const char* refused : {"G1 X1 E1", "G2 X1 I-4 E1", "G28"}) {
        Bench bench;
        (void)bench.run("M83\nG28\nG1 X1 Y9 E1 F60\nM486 S0\nM486 P0\nG1 X9 E5\nM486 S-1\n");
        bench.recorder.refuse_after = 0;
        const Log log = bench.run(std::string{refused} + "\n");
        ASSERT_EQ(log.size(), 1U) << refused;
        EXPECT_NE(log[0].find("the machine refuses"), std::string::npos) << log[0];
        EXPECT_EQ(bench.interpreter.state().machine[Axis::x].value(), 9) << refused;
        EXPECT_EQ(bench.run("G1 X9 Y2 E1\n"), (Log{"travel X9 Y2 at 1", "filament E2 at 1"})) << refused;
    }
}

TEST(Interpreter, ARefusedHomingIsNotHomed) {
    Bench bench;
    bench.recorder.refuse_after = 0;
    (void)bench.run("G28\n");
    EXPECT_FALSE(bench.interpreter.homed(Axis::x));
    (void)bench.run("G28 X Z\n");
    EXPECT_TRUE(bench.interpreter.homed(Axis::x));
    EXPECT_FALSE(bench.interpreter.homed(Axis::y));
}

TEST(Interpreter, UnhomedAxesWarnOnceEach) {
    Bench bench;
    EXPECT_EQ(bench.run("G1 X1 F60\nG1 X2\nG1 Y1\n"),
              (Log{"travel X1 at 1",
                   "warning line 1: X moves without having been homed (G28): its place is assumed",
                   "travel X2 at 1", "travel Y1 at 1",
                   "warning line 3: Y moves without having been homed (G28): its place is assumed"}));
    EXPECT_EQ(bench.interpreter.warnings(), 2U);
    EXPECT_EQ(bench.run("G28\nG1 X1\n"), (Log{"home XYZ", "travel X1 at 1"}));
    // Motors off: it may be pushed by hand.
    EXPECT_EQ(bench.run("M84 X\nG1 X2\nG1 Y2\n").size(), 4U);
    EXPECT_EQ(bench.interpreter.warnings(), 3U);
}

TEST(Interpreter, RoundingJustOutsideIsPutOntoTheBound) {
    Bench bench;
    (void)bench.run("G28\n");
    // 5.90551182 in is 150.000000228 mm.
    (void)bench.run("G20\nG1 X5.90551182 F60\n");
    ASSERT_EQ(bench.recorder.moves.size(), 1U);
    EXPECT_EQ(bench.recorder.moves[0].to[Axis::x].value(), 150);
}

TEST(Interpreter, UnknownCodesThatMoveNothingAreAnsweredAndSkipped) {
    Bench bench;
    (void)bench.run("G28\n");
    EXPECT_EQ(bench.run("M9999 X5\nD3\nQ603 MINX\nG1 X1 F60\n"),
              (Log{"unknown line 1: Unknown command: \"M9999\"", "unknown line 2: Unknown command: \"D3\"",
                   "unknown line 3: Unknown command: \"Q603\"", "travel X1 at 1"}));
    EXPECT_EQ(bench.interpreter.unknown_codes(), 3U);
}

TEST(Interpreter, WhatMayMoveAndIsNotUnderstoodIsRefused) {
    Bench bench;
    (void)bench.run("G28\n");
    EXPECT_EQ(
        bench.run("G999 X5\nPRINT_START BED=60\nM98 P\"home.g\"\nM3 S255\n"),
        (Log{"error: line 1, G999: this printer has no such G-code, and it may move",
             "error: line 2, PRINT_START: this printer has no such command, and it may move",
             "error: line 3, M98: this printer does not do it (call another file), and cannot leave it out",
             "error: line 4, M3: this printer does not do it (spindle or laser on), and cannot leave it "
             "out"}));
}

TEST(Interpreter, AMoveKnowsItsLine) {
    Bench bench;
    (void)bench.run("G28\nG1 F600\nG1 X10 ; there\n");
    ASSERT_EQ(bench.recorder.moves.size(), 1U);
    EXPECT_EQ(bench.recorder.moves[0].source, (Source{12, 27, 3, 14}));
}

TEST(Interpreter, AnArcMayBeTakenInPieces) {
    Bench bench;
    (void)bench.run("G28\nG1 X10 Y10 F600\n");
    const auto command = parse_line("G3 X30 Y10 I10 E2");
    ASSERT_TRUE(command.ok());
    bench.recorder.moves.clear();
    ASSERT_TRUE(bench.interpreter.execute(**command, 3).ok());
    EXPECT_EQ(bench.recorder.moves.size(), 3U);
    std::size_t rounds = 0;
    while (bench.interpreter.pending()) {
        ASSERT_TRUE(bench.interpreter.proceed(5).ok());
        ++rounds;
    }
    EXPECT_GT(rounds, 3U);
    const auto& moves = bench.recorder.moves;
    EXPECT_EQ(moves.back().to[Axis::x].value(), 30);
    EXPECT_EQ(moves.back().to[Axis::e].value(), 2);
    for (std::size_t i = 1; i < moves.size(); ++i) EXPECT_EQ(moves[i].from, moves[i - 1].to);

    Bench whole;
    (void)whole.run("G28\nG1 X10 Y10 F600\nG3 X30 Y10 I10 E2\n");
    ASSERT_EQ(whole.recorder.moves.size(), moves.size() + 1);
    EXPECT_EQ(whole.recorder.moves.back().to, moves.back().to);
}

TEST(Interpreter, AnArcRefusedHalfWayStandsWhereItStopped) {
    Bench bench;
    (void)bench.run("G28\nG1 X10 Y10 F600\n");
    bench.recorder.refuse_after = 4;
    const Log log = bench.run("G3 X30 Y10 I10 E2\n");
    EXPECT_EQ(log.back(), "error: line 1, G3: the machine refuses");
    EXPECT_FALSE(bench.interpreter.pending());
    const Position& stands = bench.interpreter.state().machine;
    EXPECT_EQ(stands, bench.recorder.moves.back().to);
    EXPECT_NEAR(bench.interpreter.state().programmed_e.value(), stands[Axis::e].value(), 1e-12);
}

TEST(Interpreter, PositionsComeFromOutsideAndModesAreReset) {
    Bench bench;
    (void)bench.run("G28\nG20\nG91\nM221 S50\nM220 S300\nG92 X1\n");
    Position somewhere;
    somewhere[Axis::x] = Millimetres{75};
    bench.interpreter.set_position(somewhere);
    bench.interpreter.reset_modes();
    EXPECT_EQ(bench.interpreter.programmed_position()[Axis::x].value(), 75);
    EXPECT_TRUE(bench.interpreter.homed(Axis::x));
    EXPECT_EQ(bench.run("G1 X80 E1 F60\n"), Log{"print X80 E1 at 1"});
    bench.interpreter.set_homed(Axis::y, false);
    EXPECT_FALSE(bench.interpreter.homed(Axis::y));
}

TEST(Interpreter, ProgrammedPositionIsWhatM114Shows) {
    Bench bench;
    (void)bench.run("G28\nG1 X50 E5 F60\nG92 X10 E1\nG1 Y3\n");
    const Position shown = bench.interpreter.programmed_position();
    EXPECT_EQ(shown[Axis::x].value(), 10);
    EXPECT_EQ(shown[Axis::y].value(), 3);
    EXPECT_EQ(shown[Axis::e].value(), 1);
}

TEST(Interpreter, SpeedsStaySane) {
    Bench bench;
    (void)bench.run("G28\nG1 X1 F99999999999999\nG1 X2 F.0000000000001\n");
    ASSERT_EQ(bench.recorder.moves.size(), 2U);
    EXPECT_EQ(bench.recorder.moves[0].feedrate, kFastest);
    EXPECT_EQ(bench.recorder.moves[1].feedrate, kSlowest);
}

/// RS274's words that count without a motion.
TEST(Interpreter, ASpeedAloneCounts) {
    Bench bench;
    (void)bench.run("G28\n");
    EXPECT_EQ(bench.run("F600\nG1 X10\nf333.5\nG1 X20\n"),
              (Log{"travel X10 at 10", "travel X20 at 5.55833"}));
    EXPECT_EQ(bench.run("G20\nF60\nG21\nG1 X30\n"), (Log{"travel X30 at 25.4"}));
    EXPECT_EQ(bench.run("S5000\nF600 S200\n"),
              (Log{"warning line 1: S alone is the speed of a spindle: it changes nothing here",
                   "warning line 2: S alone is the speed of a spindle: it changes nothing here"}));
    EXPECT_EQ(bench.run("F-5\nF\nF600 X5\nS5000 M3\n"),
              (Log{"error: line 1, F: F, a speed, is below 0", "error: line 2, F: F needs a number behind it",
                   "error: line 3, F: this code takes no X here, only FS",
                   "error: line 4, byte 14: more than one command on a line, at 'M3'"}));
}

TEST(Interpreter, ToolsThatAPersonChoosesAreTheOneThatIsThere) {
    Bench bench;
    for (const char* line : {"T?\n", "Tx\n", "Tc\n", "t?\n"}) {
        const Log log = bench.run(line);
        ASSERT_EQ(log.size(), 1U) << line;
        EXPECT_NE(log[0].find("choose a tool"), std::string::npos) << log[0];
    }
}

/// The reader of a job asks for it; a person's or a host's line ends nothing.
TEST(Interpreter, TwoAndThirtyEndTheProgram) {
    for (const char* end : {"M2", "M30", "M02 ; done"}) {
        Bench bench;
        EXPECT_FALSE(bench.interpreter.program_ended());
        EXPECT_EQ(bench.run(std::string{end} + "\n"), Log{}) << end;
        EXPECT_TRUE(bench.interpreter.program_ended()) << end;
        bench.interpreter.reset_modes();
        EXPECT_FALSE(bench.interpreter.program_ended()) << end;
    }
    Bench bench;
    const Log log = bench.run("M30 part.gco\n");
    ASSERT_EQ(log.size(), 1U);
    EXPECT_NE(log[0].find("skipped"), std::string::npos) << "a file's name: Marlin's M30";
    EXPECT_FALSE(bench.interpreter.program_ended());
}

TEST(Interpreter, AMessageOfAnyLengthFailsNothing) {
    Bench bench;
    const Log log = bench.run("M117 " + std::string(400, 'a') + "\nM118 " + std::string(2000, 'b') + "\n");
    ASSERT_EQ(log.size(), 2U);
    EXPECT_EQ(log[0].rfind("message [aaaa", 0), 0U) << log[0];
    EXPECT_EQ(log[1].rfind("echo line 2: bbbb", 0), 0U) << log[1];
}

}  // namespace
}  // namespace qduino::printer::gcode::interpreter_test
