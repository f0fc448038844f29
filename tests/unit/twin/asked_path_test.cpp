#include "twin/asked_path.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "tests/unit/twin/text_source.h"
#include "twin/line_reader.h"

namespace qduino::twin {
namespace {

std::vector<AskedItem> items_of(const std::string& gcode, const Position& start = {}) {
    TextSource source(gcode);
    AskedPath path(source, start, {0, 0, 0});
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

TEST(LineReader, AnEAfterANumberIsAWordNotAnExponent) {
    const CommandLine line = LineReader::parse("G1 X1E2");
    EXPECT_DOUBLE_EQ(line.value('X'), 1);
    EXPECT_DOUBLE_EQ(line.value('E'), 2);
}

TEST(LineReader, WhatIsNoCommandCommandsNothing) {
    for (const char* text :
         {"", "   ", "; G1 X1", "T0", "EXCLUDE_OBJECT_START NAME=G1", "<xml>", "G", "N5", "*7"})
        EXPECT_EQ(LineReader::parse(text).letter, 0) << text;
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
    AskedPath path(source, {}, {0, 0, 0});
    while (path.next().kind != AskedItem::Kind::end) {
    }
    EXPECT_DOUBLE_EQ(path.filament_net_mm(), 10 + 5 - 2);
    EXPECT_DOUBLE_EQ(path.filament_pushed_mm(), 15);
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
    EXPECT_LE(worst, 1.001 * AskedPath::kChordErrorMm);
    EXPECT_EQ(items.back().to, (Position{0, 10, 3, 1}));
    EXPECT_NEAR(length_of(items, start), 10 * std::numbers::pi / 2, 1e-3);
}

TEST(AskedPath, RadiusFormTakesTheShortOrTheLongWay) {
    const Position start{10, 0, 0, 0};
    EXPECT_NEAR(length_of(items_of("G3 X0 Y10 R10\n", start), start), 10 * std::numbers::pi / 2, 1e-3);
    EXPECT_NEAR(length_of(items_of("G3 X0 Y10 R-10\n", start), start), 10 * std::numbers::pi * 1.5, 1e-3);
    EXPECT_NEAR(length_of(items_of("G2 X0 Y10 R-10\n", start), start), 10 * std::numbers::pi * 1.5, 2e-3);
    EXPECT_NEAR(length_of(items_of("G2 X10 Y0 I-10\n", start), start), 10 * std::numbers::pi * 2, 2e-3);
    EXPECT_EQ(items_of("G2 X10 Y0 R10\n", start).size(), 0u) << "no circle is meant";
    EXPECT_EQ(items_of("G2 X12 Y0\n", start).size(), 1u) << "no centre: a straight line";
}

}  // namespace
}  // namespace qduino::twin
