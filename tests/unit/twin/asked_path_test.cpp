#include "twin/asked_path.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "tests/unit/twin/text_source.h"
#include "twin/line_reader.h"

namespace qduino::twin::asked_path_test {
namespace {

std::vector<AskedItem> items_of(const std::string& gcode, const Position& start = {}) {
    TextSource source(gcode);
    AskedPath path(source, start, Machine{});
    std::vector<AskedItem> items;
    for (AskedItem item = path.next(); item.kind != AskedItem::Kind::end; item = path.next())
        items.push_back(item);
    EXPECT_EQ(path.next().kind, AskedItem::Kind::end);
    return items;
}

TEST(LineReader, WordsNumbersAndComments) {
    const CommandLine line = LineReader::parse("N12 g1 X10.5Y-.25 (through (the) E5 E+1.5;F9\t*37");
    EXPECT_EQ(line.letter, 'G');
    EXPECT_EQ(line.number, 1);
    EXPECT_DOUBLE_EQ(line.value('X'), 10.5);
    EXPECT_DOUBLE_EQ(line.value('Y'), -0.25);
    EXPECT_DOUBLE_EQ(line.value('E'), 1.5);
    EXPECT_FALSE(line.has('F'));
    EXPECT_FALSE(line.has('Z'));
}

TEST(LineReader, OnlyANumberedLineEndsWithACheckSum) {
    EXPECT_EQ(LineReader::parse("A_WORD X=1 *12 MOVE=1").word_value("MOVE"), "1");
    EXPECT_EQ(LineReader::parse("N7 A_WORD X=1 *12").word_value("X"), "1");
    EXPECT_FALSE(LineReader::parse("N7 A_WORD X=1 *12 MOVE=1").word_value("MOVE").has_value());
}

TEST(LineReader, AByteOrderMarkBeginsAFileAndNoOtherLine) {
    TextSource source("\xEF\xBB\xBFG28\n\xEF\xBB\xBFG28");
    LineReader reader(source);
    EXPECT_EQ(reader.next()->letter, 'G');
    EXPECT_EQ(reader.next()->letter, 0);
}

TEST(LineReader, AnEBehindADigitIsAnExponentWhereWordsStandApart) {
    struct Case {
        const char* line;
        double x, e, f;
    };
    for (const Case& c : std::initializer_list<Case>{{"G1 X4e1 Y40", 40, 0, 0},
                                                     {"G1 X1E2", 100, 0, 0},
                                                     {"G1 F1.2e+3", 0, 0, 1200},
                                                     {"G1 X60 E8.5e-05", 60, 8.5e-05, 0},
                                                     {"N5 G1 X4e1*33", 40, 0, 0},
                                                     {"G1 X4E.5", 4, 0.5, 0},
                                                     {"G1 X4E0.5", 4, 0.5, 0},
                                                     {"G1 X4.E2", 4, 2, 0},
                                                     {"G1E2", 0, 2, 0},
                                                     {"g1x60y40e1f1200", 60, 1, 1200},
                                                     {"N5G1X60E-1*33", 60, -1, 0},
                                                     {"G1X1.2e+1Y3", 12, 0, 0},
                                                     {"G1X3.05e-05E2", 3.05e-05, 2, 0},
                                                     {"M104S2e2F1", 0, 0, 1}}) {
        const CommandLine line = LineReader::parse(c.line);
        EXPECT_DOUBLE_EQ(line.value('X'), c.x) << c.line;
        EXPECT_DOUBLE_EQ(line.value('E'), c.e) << c.line;
        EXPECT_DOUBLE_EQ(line.value('F'), c.f) << c.line;
    }
    EXPECT_DOUBLE_EQ(LineReader::parse("M104S2e2").value('S'), 200) << "it has no word E";
    EXPECT_EQ(LineReader::parse("SET_GCODE_OFFSET Z=-1e-1").word_number("Z"), -0.1);
}

/// RS274: what stands in parentheses is a comment, and a `;` in it is a part of that.
TEST(LineReader, ParenthesesHideASemicolonAndQuotesHideBoth) {
    for (const char* text : {"G1 X60 (say; E5 G28) Y40 E1", "G1 X60 (a) Y40 (b;c) E1 ; (d",
                             "N3 G1 X60(;)Y40 E1*12", "G1 X60 Y40 E1 ;(E5"}) {
        const CommandLine line = LineReader::parse(text);
        EXPECT_EQ(line.number, 1) << text;
        EXPECT_DOUBLE_EQ(line.value('X'), 60) << text;
        EXPECT_DOUBLE_EQ(line.value('Y'), 40) << text;
        EXPECT_DOUBLE_EQ(line.value('E'), 1) << text;
    }
    const auto name = [](const char* line) {
        const CommandLine command = LineReader::parse(line);
        return std::string{command.word_name("NAME", {}).value_or("none")};
    };
    EXPECT_EQ(LineReader::parse("M593 P\"a;b(\" F40 ;x").value('F'), 40);
    EXPECT_EQ(name("EXCLUDE_OBJECT NAME=a(1;b"), "a(1");
    EXPECT_EQ(name("EXCLUDE_OBJECT NAME=\"a;b\" ;c"), "a;b");
    EXPECT_EQ(name("EXCLUDE_OBJECT NAME=12\";c\""), "12\"");
}

TEST(LineReader, ANameIsWhole) {
    const auto name = [](const char* line) {
        const CommandLine command = LineReader::parse(line);
        return std::string{command.word_name("NAME", {"CENTER", "RESET"}).value_or("none")};
    };
    EXPECT_EQ(name("A_WORD NAME=Box 1 CENTER=40,40"), "Box 1");
    EXPECT_EQ(name("A_WORD RESET=1 name=Box 1\t"), "Box 1");
    EXPECT_EQ(name("A_WORD NAME='Bob's part 2'"), "Bob's part 2");
    EXPECT_EQ(name("A_WORD NAME=A=B x=1 center=2"), "A=B x=1");
    EXPECT_EQ(name("A_WORD RESET=1"), "none");
}

TEST(LineReader, WhatIsNoCommandCommandsNothing) {
    for (const char* text :
         {"", "   ", "; G1 X1", "T0", "EXCLUDE_OBJECT_START NAME=G1", "<xml>", "G", "N5", "*7"})
        EXPECT_EQ(LineReader::parse(text).letter, 0) << text;
    EXPECT_EQ(LineReader::parse("EXCLUDE_OBJECT_START NAME=G1").word, "EXCLUDE_OBJECT_START");
    EXPECT_EQ(LineReader::parse("a_word x=1 NAME=\"b c\" Y=2").word_value("name"), "b c");
    EXPECT_EQ(LineReader::parse("A_WORD NAME=\"b c\" Y=-2.5").word_number("Y"), -2.5);
    EXPECT_FALSE(LineReader::parse("A_WORD Y=").word_number("Y").has_value());
    EXPECT_EQ(LineReader::parse("M117 Going to X10").number, 117);
}

TEST(LineReader, LongLinesAreCutAndCountedOnce) {
    TextSource source("G1 X1 ;" + std::string(100'000, 'x') + "\nG1 X2\r\n\nG1 X3");
    LineReader reader(source);
    EXPECT_DOUBLE_EQ(reader.next()->value('X'), 1);
    EXPECT_DOUBLE_EQ(reader.next()->value('X'), 2);
    EXPECT_EQ(reader.number(), 2u);
    EXPECT_EQ(reader.next()->letter, 0);
    EXPECT_DOUBLE_EQ(reader.next()->value('X'), 3);
    EXPECT_FALSE(reader.next().has_value());
    EXPECT_EQ(reader.number(), 4u);
}

TEST(AskedPath, ItemsThatMoveNothingAreNotGiven) {
    const auto items = items_of("G1 F3000\nG1 X0\nG1 X5\nG1 X5 Y0\nG92 X5\nM104 S200\nG1 Y2\n");
    ASSERT_EQ(items.size(), 2u);
    EXPECT_EQ(items[0].line, 3u);
    EXPECT_EQ(items[1].line, 7u);
    EXPECT_EQ(items[1].to, (Position{5, 2, 0, 0}));
}

TEST(AskedPath, NinetyOneSetsTheExtruderRelativeAndEightyTwoBackAgain) {
    const auto items = items_of("G91\nG1 E1\nG1 E1\nM82\nG1 E5 X1\nG1 X1\nG90\nG1 E2\n");
    ASSERT_EQ(items.size(), 5u);
    EXPECT_DOUBLE_EQ(items[1].to[3], 2);
    EXPECT_EQ(items[2].to, (Position{1, 0, 0, 5}));
    EXPECT_DOUBLE_EQ(items[3].to[0], 2);
    EXPECT_DOUBLE_EQ(items[4].to[3], 2);
}

TEST(AskedPath, TheExtrudersModeIsAsTheFilesFirmwareHasIt) {
    const auto filament = [](const std::string& text) { return items_of(text).back().to[3]; };
    const std::string script = "M83\nG1 E5\nG91\nG1 Z1\nG90\nG1 X9 E1\n";
    for (const char* own : {"SET_VELOCITY_LIMIT ACCEL=500", "EXCLUDE_OBJECT_END", "; gcode_flavor = klipper",
                            "; gcode_flavor = reprapfirmware", ";FLAVOR:RepRap", "M572 S0",
                            "M862.3 P\"MK3S\"", "; printer_model = MK3S"})
        EXPECT_EQ(filament(std::string{own} + "\n" + script), 6) << own;
    for (const char* marlin :
         {"", ";FLAVOR:Marlin", "TX", "M862.3 P\"MK3.9\"", "; printer_model = MK4", "M900 K0"})
        EXPECT_EQ(filament(std::string{marlin} + "\n" + script), 1) << marlin;
    const std::string end = "M82\nG1 E10\nG91\nG1 E-2\n";
    EXPECT_EQ(filament(end), 8);
    EXPECT_EQ(filament("; gcode_flavor = klipper\n" + end), 8);
    EXPECT_EQ(filament("M572 S0\n" + end), 8);
}

TEST(AskedPath, HomingNamesItsAxesAndForgetsTheirOffsets) {
    const auto items = items_of("G1 X10 Y10\nG92 X0 Y0\nG28 X0\nG1 X3 Y3\nG28\n");
    ASSERT_EQ(items.size(), 4u);
    EXPECT_EQ(items[1].kind, AskedItem::Kind::home);
    EXPECT_EQ(items[1].homed, 0b001);
    EXPECT_EQ(items[1].to, (Position{0, 10, 0, 0}));
    EXPECT_EQ(items[2].to, (Position{3, 13, 0, 0}));
    EXPECT_EQ(items[3].homed, 0b111);
}

TEST(AskedPath, SetPositionWithoutALetterMakesEveryAxisZero) {
    const auto items = items_of("G1 X10 Y20 Z1 E5\nG92\nG1 X1 Y2 Z3 E1\n");
    ASSERT_EQ(items.size(), 2u);
    EXPECT_EQ(items[1].to, (Position{11, 22, 4, 6}));
}

TEST(AskedPath, MachineCoordinatesForgetEveryOffset) {
    const auto items = items_of("G1 X10 Y20\nG92 X0 Y0\nG1 X1\nG92.1\nG1 X5\n");
    ASSERT_EQ(items.size(), 3u);
    EXPECT_EQ(items[1].to, (Position{11, 20, 0, 0}));
    EXPECT_EQ(items[2].to, (Position{5, 20, 0, 0}));
}

TEST(AskedPath, FlowScalesFilamentFromThenOn) {
    TextSource source("G1 E10\nM221 S50\nG1 E20\nM83\nG1 E-4\n");
    AskedPath path(source, {}, Machine{});
    while (path.next().kind != AskedItem::Kind::end) {
    }
    EXPECT_DOUBLE_EQ(path.filament_net_mm(), 10 + 5 - 2);
    EXPECT_DOUBLE_EQ(path.filament_pushed_mm(), 15);
}

TEST(AskedPath, FirmwareRetractionDrawsLiftsAndPushesAgain) {
    const auto items = items_of("M207 S2 Z0.5\nM208 S0.1\nG1 X5 E3\nG10\nG10\nG1 X9\nG11\nG11\nG1 E4\n");
    ASSERT_EQ(items.size(), 7u);
    EXPECT_EQ(items[1].to, (Position{5, 0, 0, 1}));
    EXPECT_EQ(items[2].to, (Position{5, 0, 0.5, 1}));
    EXPECT_EQ(items[3].to, (Position{9, 0, 0.5, 1}));
    EXPECT_EQ(items[4].to, (Position{9, 0, 0, 1}));
    EXPECT_NEAR(items[5].to[3], 3.1, 1e-12);
    EXPECT_NEAR(items[6].to[3], 4.1, 1e-12) << "the words of E know nothing of it";
    EXPECT_EQ(items_of("G10 P0 S200\nG11\n").size(), 0u) << "a tool's temperature is no retraction";
}

TEST(AskedPath, VolumetricWordsAreCubicMillimetres) {
    const double area = std::numbers::pi / 4 * 2.85 * 2.85;
    const auto items = items_of("M200 D2.85\nG1 E10\nM200 D0\nG1 E11\nM200 S1\nG1 E12\n");
    ASSERT_EQ(items.size(), 3u);
    EXPECT_NEAR(items[0].to[3], 10 / area, 1e-12);
    EXPECT_NEAR(items[1].to[3], 10 / area + 1, 1e-12);
    EXPECT_NEAR(items[2].to[3], 11 / area + 1, 1e-12);
}

TEST(AskedPath, StepsPerMillimetreOfFilamentScaleIt) {
    const auto items = items_of("M92 E48\nG1 E2\nM92 X1\nG1 X1\n");
    ASSERT_EQ(items.size(), 2u);
    EXPECT_DOUBLE_EQ(items[0].to[3], 1) << "this drive takes 96";
    EXPECT_DOUBLE_EQ(items[1].to[0], 1) << "of a slide the machine knows better";
}

TEST(AskedPath, OffsetsOutlastAHoming) {
    const auto items =
        items_of("M206 X-2\nSET_GCODE_OFFSET z_adjust=0.5 MOVE=1\nG1 X1 Z1\nG28 X Z\nG1 X1 Z1\n");
    ASSERT_EQ(items.size(), 4u);
    EXPECT_EQ(items[0].to, (Position{0, 0, 0.5, 0}));
    EXPECT_EQ(items[1].to, (Position{3, 0, 1.5, 0}));
    EXPECT_EQ(items[3].to, (Position{3, 0, 1.5, 0}));
}

TEST(AskedPath, AxesThatAreNotThereAreNotHomed) {
    EXPECT_EQ(items_of("G28 U0\n").size(), 0u);
    EXPECT_EQ(items_of("G28 X0 U0\n")[0].homed, 0b001);
    EXPECT_EQ(items_of("G28 W\n")[0].homed, 0b111);
}

TEST(AskedPath, WordsThatAreMacrosStandForTheirLines) {
    Machine machine;
    machine.macros.push_back({"PRIME", "G1 X{TO=5} E{e}\nG1 Y1"});
    TextSource source("prime E=2\nPRIME TO=\"9\" E=3\nOTHER E=9\n");
    AskedPath path(source, {}, machine);
    EXPECT_EQ(path.next().to, (Position{5, 0, 0, 2}));
    EXPECT_EQ(path.next().to, (Position{5, 1, 0, 2}));
    const AskedItem third = path.next();
    EXPECT_EQ(third.to, (Position{9, 1, 0, 3}));
    EXPECT_EQ(third.line, 2u);
    EXPECT_EQ(path.next().kind, AskedItem::Kind::end);
}

TEST(AskedPath, AnObjectThatIsLeftOutIsNotAsked) {
    const auto items = items_of(
        "M486 P1\nG1 X10 Z1\nM486 S1\nG1 X20 E5\nG1 Z2\nM486 S-1\nG1 X30 E6\nEXCLUDE_OBJECT NAME=a\n"
        "EXCLUDE_OBJECT_START NAME=a\nG1 X99\nEXCLUDE_OBJECT_END\nG1 X31 E7\n");
    ASSERT_EQ(items.size(), 6u);
    EXPECT_EQ(items[0].to, (Position{10, 0, 1, 0}));
    EXPECT_EQ(items[1].to, (Position{10, 0, 2, 0})) << "up first";
    EXPECT_EQ(items[2].to, (Position{30, 0, 2, 0}));
    EXPECT_EQ(items[3].to, (Position{30, 0, 2, 1})) << "of the filament only what follows";
    EXPECT_EQ(items[4].to, (Position{31, 0, 2, 1}));
}

/// What moves nothing leaves nothing out: the head does not wait behind it, and the filament of the
/// next line is pushed. In Klipper, too, such a move makes no offset (its module
/// exclude_object).
TEST(AskedPath, ALineOfAnObjectLeftOutThatMovesNothingMakesNoHeadWait) {
    for (const char* nothing : {"", "G1", "G1 X10 E0", "M207 S0\nG10\nG11"}) {
        const auto items =
            items_of("M83\nG1 X10\nM486 S1 C\n" + std::string{nothing} + "\nM486 S-1\nG1 X10 E2\n");
        ASSERT_EQ(items.size(), 2u) << nothing;
        EXPECT_EQ(items[1].to, (Position{10, 0, 0, 2})) << nothing;
    }
    const auto waits = items_of("M83\nG1 X10\nM486 S1 C\nG1 E1\nM486 S-1\nG1 X10 E2\n");
    EXPECT_EQ(waits.size(), 1u) << "filament alone is a move";
}

/// What an object that is left out drew back or pushed is made up for before a homing, which ends
/// the wait.
TEST(AskedPath, FilamentIsWhereTheProgramHasItBeforeAHoming) {
    const auto pushed =
        items_of("M83\nG1 X1 E5\nG1 E-2\nM486 S0 C\nG1 E2\nG1 X2 E1\nM486 S-1\nG28 X\nG1 X4 E1\n");
    ASSERT_EQ(pushed.size(), 5u);
    EXPECT_EQ(pushed[2].to, (Position{1, 0, 0, 5}));
    EXPECT_EQ(pushed[3].kind, AskedItem::Kind::home);
    EXPECT_EQ(pushed[4].to, (Position{4, 0, 0, 6}));
    const auto drawn = items_of("M83\nG1 X1 E5\nM486 S0 C\nG1 X2 E1\nG1 E-2\nG28 X\n");
    ASSERT_EQ(drawn.size(), 3u);
    EXPECT_EQ(drawn[1].to, (Position{1, 0, 0, 3}));
}

TEST(AskedPath, AnObjectsNameSaysNothingAndItsLabelsHaveMarlinsOrder) {
    const auto at = [](const std::string& labels) {
        const auto items = items_of(labels + "\nG1 X9\n");
        return items.empty() ? 0.0 : items.back().to[0];
    };
    for (const char* built : {"M486 S0\nM486 ACup P0", "M486 S0 A\"C P0\"", "M486 S0 A\"P0", "M486 S1 C U1",
                              "M486 P1 U1 S1", "M486 S0 P", "M486 P1\nM486 S1\nM486 S-1G1"})
        EXPECT_EQ(at(built), 9) << built;
    for (const char* left_out :
         {"M486 S0\nM486 P0 ACup", "M486 S3 C P4", "M486 S1 C S", "M486 S0 A\"lid\" C"})
        EXPECT_EQ(at(left_out), 0) << left_out;
}

/// What stands behind the last object takes the head out of the part, though it does not go
/// sideways.
TEST(AskedPath, BehindALeftOutObjectTheHeadGoesUpAtOnce) {
    const std::string cut = "M83\nG1 X30 Y30 Z1\nM486 S1 C\nG1 X50 E1\nM486 S-1\n";
    const auto lifted = items_of(cut + "G1 E-2\nG91\nG1 Z10\nG90\nG28 X0 Y0\n");
    ASSERT_EQ(lifted.size(), 4u);
    EXPECT_EQ(lifted[1].to, (Position{30, 30, 1, -2}));
    EXPECT_EQ(lifted[2].to, (Position{30, 30, 11, -2}));
    EXPECT_EQ(lifted[3].homed, 0b011);
    const auto down = items_of(cut + "G1 Z5\nG1 Z2\nG1 X9\n");
    ASSERT_EQ(down.size(), 4u);
    EXPECT_EQ(down[1].to[2], 5) << "up at once";
    EXPECT_EQ(down[2].to, (Position{9, 30, 5, 0})) << "down only there";
    EXPECT_EQ(down[3].to[2], 2);
}

TEST(AskedPath, AHeadThatWaitsBelowTheProgramIsTakenUpFirst) {
    const std::string cut = "M83\nG1 X30 Y30 Z1\nM486 S1 C\nG1 X50 Y60 E1\nG1 Z20\nG1 E-2\nM486 S-1\n";
    for (const char* then : {"G28 X\n", "M84\n", ""}) {
        const auto items = items_of(cut + then);
        ASSERT_GE(items.size(), 3u) << then;
        EXPECT_EQ(items[1].to, (Position{30, 30, 1, -2})) << then;
        EXPECT_EQ(items[2].to, (Position{30, 30, 20, -2})) << then;
    }
    const auto owed = items_of(cut + "G28 X\nG1 X10\n");
    ASSERT_EQ(owed.size(), 5u);
    EXPECT_EQ(owed[3].to, (Position{0, 30, 20, -2}));
    EXPECT_EQ(owed[4].to, (Position{10, 60, 20, -2})) << "Y was owed";
    EXPECT_EQ(items_of(cut + "M84 S60\nM18 E\nG1 X9\n")[1].line, 10u) << "nothing goes off";
}

TEST(AskedPath, ObjectsAreToldApartByTheirWholeNames) {
    const auto items = items_of(
        "EXCLUDE_OBJECT NAME='Bob's part 1'\nEXCLUDE_OBJECT_START NAME='Bob's part 1'\nG1 "
        "X9\nEXCLUDE_OBJECT_END\n"
        "EXCLUDE_OBJECT_START NAME='Bob's part 2'\nG1 X7\nEXCLUDE_OBJECT_END\nEXCLUDE_OBJECT NAME=Box 1\n"
        "EXCLUDE_OBJECT_START NAME=BOX 1\nG1 X5\nEXCLUDE_OBJECT_START NAME=Box 2\nG1 X3\n");
    ASSERT_EQ(items.size(), 2u);
    EXPECT_EQ(items[0].to[0], 7);
    EXPECT_EQ(items[1].to[0], 3);
    const auto older = items_of(
        "EXCLUDE_OBJECT NAME=a\nSTART_CURRENT_OBJECT NAME=a\nG1 X9\nEND_CURRENT_OBJECT NAME=a\n"
        "START_CURRENT_OBJECT NAME=b\nG1 X7\nEND_CURRENT_OBJECT NAME=b\n");
    ASSERT_EQ(older.size(), 1u);
    EXPECT_EQ(older[0].to[0], 7);
}

double length_of(const std::vector<AskedItem>& items, Position from) {
    double length = 0;
    for (const AskedItem& item : items) {
        length += std::hypot(item.to[0] - from[0], item.to[1] - from[1]);
        from = item.to;
    }
    return length;
}

TEST(AskedPath, ChordsStayOnTheirArc) {
    const Position start{10, 0, 0, 0};
    const auto items = items_of("G3 X0 Y10 Z3 E1 I-10 J0\n", start);
    ASSERT_GT(items.size(), 50u);
    double worst = 0;
    Position from = start;
    for (const AskedItem& item : items) {
        EXPECT_NEAR(std::hypot(item.to[0], item.to[1]), 10, 1e-9);
        worst = std::max(worst, 10 - std::hypot((item.to[0] + from[0]) / 2, (item.to[1] + from[1]) / 2));
        EXPECT_GT(item.to[2], from[2]);
        from = item.to;
    }
    EXPECT_LE(worst, 1.001 * AskedCurve::kChordErrorMm);
    EXPECT_EQ(items.back().to, (Position{0, 10, 3, 1}));
    EXPECT_NEAR(length_of(items, start), 10 * std::numbers::pi / 2, 1e-3);
}

TEST(AskedPath, ArcsLieInTheirPlane) {
    const Position start{0, 0, 10, 0};
    for (const AskedItem& item : items_of("G18\nG3 X10 Z0 Y2 K-10 I0\n", start)) {
        EXPECT_NEAR(std::hypot(item.to[2], item.to[0]), 10, 1e-9);
        EXPECT_GT(item.to[0], 0) << "from Z to X";
        EXPECT_TRUE(item.curved);
    }
    const auto full = items_of("G19\nG2 J3 P2\n", start);
    double turned = 0;
    Position from = start;
    for (const AskedItem& item : full) {
        turned += std::hypot(item.to[1] - from[1], item.to[2] - from[2]);
        from = item.to;
    }
    EXPECT_NEAR(turned, 2 * 2 * std::numbers::pi * 3, 0.01) << "two turns";
}

TEST(AskedPath, ASplineIsDeCasteljaus) {
    const auto items = items_of("G5 X20 Y0 I0 J10 P0 Q10 E4\n");
    ASSERT_GT(items.size(), 100u);
    double highest = 0;
    for (const AskedItem& item : items) highest = std::max(highest, item.to[1]);
    EXPECT_NEAR(highest, 7.5, 1e-3) << "3/4 of the control points' height";
    EXPECT_EQ(items.back().to, (Position{20, 0, 0, 4}));
}

TEST(AskedPath, RadiusFormTakesTheShortOrTheLongWay) {
    const Position start{10, 0, 0, 0};
    EXPECT_NEAR(length_of(items_of("G3 X0 Y10 R10\n", start), start), 10 * std::numbers::pi / 2, 1e-3);
    EXPECT_NEAR(length_of(items_of("G3 X0 Y10 R-10\n", start), start), 10 * std::numbers::pi * 1.5, 1e-3);
    EXPECT_NEAR(length_of(items_of("G2 X0 Y10 R-10\n", start), start), 10 * std::numbers::pi * 1.5, 2e-3);
    EXPECT_NEAR(length_of(items_of("G2 X10 Y0 I-10\n", start), start), 10 * std::numbers::pi * 2, 2e-3);
    EXPECT_EQ(items_of("G2 X10 Y0 R10\n", start).size(), 0u) << "no circle is meant";
    const std::string ten = "G91\n" + [] {
        std::string moves;
        for (int i = 0; i < 10; ++i) moves += "G1 X0.1\n";
        return moves;
    }() + "G90\n";
    const auto circle = items_of(ten + "G2 X11 Y0 I-10\n", start);
    EXPECT_NEAR(length_of(circle, start), 10 * std::numbers::pi * 2 + 1, 2e-3)
        << "ends that rounding has parted";
    EXPECT_EQ(items_of("G2 X12 Y0\n", start).size(), 1u) << "no centre: a straight line";
}

}  // namespace
}  // namespace qduino::twin::asked_path_test
