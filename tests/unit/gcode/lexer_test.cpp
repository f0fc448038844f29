#include "printer/gcode/lexer.h"

#include <gtest/gtest.h>

#include <map>
#include <string>

namespace qduino::printer::gcode::lexer_test {
namespace {

/// `G1 X10 Y` as "G1 X=10 Y".
std::string describe(const Command& command) {
    std::string out{command.name().view()};
    for (char letter = 'A'; letter <= 'Z'; ++letter) {
        if (!command.parameters.has(letter)) continue;
        out += std::string(" ") + letter;
        if (const auto value = command.parameters.value(letter)) {
            char digits[64];
            std::snprintf(digits, sizeof digits, "=%.10g", *value);
            out += digits;
        }
    }
    if (!command.text.empty()) out += " [" + std::string(command.text.view()) + "]";
    return out;
}

std::string read(std::string_view code) {
    Command command;
    const auto words = parse_words(code, command);
    if (!words) return "error: " + std::string(words.error().message.view());
    return *words ? describe(command) : "nothing";
}

TEST(Lexer, ReadsEverySpellingOfACommand) {
    const std::map<std::string, std::string> cases{
        {"G1 X10 Y-5.5", "G1 X=10 Y=-5.5"},
        {"g1x10y-5.5", "G1 X=10 Y=-5.5"},
        {"G 1 X 10 Y -5.5", "G1 X=10 Y=-5.5"},
        {"G1X10Y-5.5E3F1800", "G1 E=3 F=1800 X=10 Y=-5.5"},
        {"G01 X.5", "G1 X=0.5"},
        {"G28", "G28"},
        {"G28 X Y", "G28 X Y"},
        {"G28 XY", "G28 X Y"},
        {"G28X0", "G28 X=0"},
        {"M84 X Y E", "M84 E X Y"},
        {"G92.1", "G92.1"},
        {"M862.3 P \"MK3S\"", "M862.3 P [MK3S]"},
        {"M486 A\"part 1\" S2", "M486 A S=2 [part 1]"},
        {"T0", "T0"},
        {"M106 S229.5", "M106 S=229.5"},
        {"X10 Y10", "X10 Y=10"},
        {"M115 U3.13.3", "M115 [U3.13.3]"},
        {"M486 Apart (1)", "M486 A [part (1)]"},
        {"M486 S2 A Cup P3 U4", "M486 A S=2 [Cup P3 U4]"},
        {"M486 A", "M486 A"},
        {"M486 A\"lid", "M486 A [\"lid]"},
        {"M862.3 P\"MK3", "M862.3 [P\"MK3]"},
        {"M1002 action : 2", "M1002 [action : 2]"},
        {"M620 S0A S1 G1 X5", "M620 [S0A S1 G1 X5]"},
        {"M117", "M117"},
        {"M117 Layer 1/240: 5% \"ok\"", "M117 [Layer 1/240: 5% \"ok\"]"},
        {"m117Hello", "M117 [Hello]"},
        {"M118   E1 spaced  ", "M118 [E1 spaced]"},
        {"M0 Click to go on", "M0 [Click to go on]"},
        {"M23 /part.gco", "M23 [/part.gco]"},
        {"EXCLUDE_OBJECT_START NAME=cube_1", "EXCLUDE_OBJECT_START [NAME=cube_1]"},
        {"exclude_object_end", "EXCLUDE_OBJECT_END"},
        {"", "nothing"},
        {"   ", "nothing"},
        {"%", "nothing"},
    };
    for (const auto& [code, expected] : cases) EXPECT_EQ(read(code), expected) << code;
}

TEST(Lexer, RefusesWhatIsMalformedAndSaysWhat) {
    const std::map<std::string, std::string> cases{
        {"G", "a command needs a number"},
        {"G-1", "a command needs a number"},
        {"G1.", "a subcode is not a number"},
        {"G92.x", "a subcode is not a number"},
        {"G100000", "a command needs a number"},
        {"G99999999999999999999", "a command needs a number"},
        {"123", "begins with a letter"},
        {"-X1", "begins with a letter"},
        {"\xC3\xA9", "begins with a letter"},
        {"G1 X1 X2", "the same letter twice"},
        {"G1 X1x2", "the same letter twice"},
        {"G1 X1.2.3", "expected a letter"},
        {"G1 X-", "not a number"},
        {"G1 X--1", "not a number"},
        {"G1 X=1", "not a number"},
        {"G1 X10,5", "expected a letter"},
        {"G1 X1 \x01", "expected a letter"},
        {"G1 10", "expected a letter"},
        {"G90 G1 X5", "more than one command"},
        {"G1 X5 M5", "more than one command"},
        {"M486 S-1G1", "more than one command"},
        {"M486 S1 S2", "the same letter twice"},
        {"G1 X\"5", "a quote without its end"},
        {"G1 X\xC2\xB5", "not a number"},
        {"G1 X1 ?", "expected a letter"},
    };
    for (const auto& [code, expected] : cases) {
        const std::string got = read(code);
        EXPECT_EQ(got.rfind("error: ", 0), 0U) << code << " gave " << got;
        EXPECT_NE(got.find(expected), std::string::npos) << code << " gave " << got;
    }
}

TEST(Lexer, AnErrorQuotesHostileBytesHarmlessly) {
    const std::string got = read("G1 X1 \x1B[31m<script>");
    EXPECT_EQ(got.find('\x1B'), std::string::npos);
    EXPECT_NE(got.find("?[31m"), std::string::npos);
}

TEST(Lexer, AnExponentIsAPartOfItsNumber) {
    const std::map<std::string, std::string> cases{
        {"G1 F1.2e+3", "G1 F=1200"},
        {"G1 X4e1 Y40", "G1 X=40 Y=40"},
        {"G1 X60.001 E8.5e-05", "G1 E=8.5e-05 X=60.001"},
        {"G1 Y3.05E-05 E1", "G1 E=1 Y=3.05e-05"},
        {"G1 X-.5e+01", "G1 X=-5"},
        {"G1 X+5e0", "G1 X=5"},
        {"G1 X1E2E3", "G1 E=3 X=100"},
        {"M104 S2e2", "M104 S=200"},
        {"M104S2e2", "M104 S=200"},  // it has no word E
        {"G1 X10E.5", "G1 E=0.5 X=10"},
        {"G1 X10E0.5", "G1 E=0.5 X=10"},  // an exponent has no point
        {"G1 X10.E5", "G1 E=5 X=10"},     // and stands behind a digit
        {"G1 X10 E5", "G1 E=5 X=10"},
        {"G1E5", "G1 E=5"},
        {"G1 X1e", "G1 E X=1"},
        {"G1 X1e+", "error: not a number"},
        {"G1 X1e999", "error: not a number"},
        {"G1 X1e-999", "error: not a number"},
        // Packed: words follow one another without blanks.
        {"g1x60y40e1f1200", "G1 E=1 F=1200 X=60 Y=40"},
        {"G1X4e1Y40", "G1 E=1 X=4 Y=40"},
        {"G1X60E-1", "G1 E=-1 X=60"},
        {"G1X60E1e-05F300", "G1 E=1e-05 F=300 X=60"},
        {"G1X1.2e+1Y3", "G1 X=12 Y=3"},
        {"G1X3.05e-05Y3", "G1 X=3.05e-05 Y=3"},
        {"G1X1E2E3", "error: the same letter twice"},
    };
    for (const auto& [code, expected] : cases)
        EXPECT_EQ(read(code).rfind(expected, 0), 0U) << code << ": " << read(code);
}

TEST(Lexer, InfinityAndNotANumberAreWordsLikeOthers) {
    EXPECT_EQ(read("G1 Xinf"), "G1 F I N X");  // letters without numbers; G1 takes none of them
    EXPECT_EQ(read("G1 Xnan").rfind("error", 0), 0U);
}

TEST(Lexer, TextIsCutAtItsBoundAndSaysSo) {
    Command command;
    ASSERT_TRUE(parse_words("EXCLUDE_OBJECT_DEFINE NAME=" + std::string(400, 'a'), command).ok());
    EXPECT_EQ(command.text.size(), kCommandBytesMax);
    EXPECT_TRUE(command.text_cut);
    ASSERT_TRUE(parse_words("M117 ok", command).ok());
    EXPECT_FALSE(command.text_cut);
}

TEST(Lexer, BytesOfNoEncodingStayApartInAWordsText) {
    EXPECT_EQ(read("EXCLUDE_OBJECT NAME=test\xFC"), "EXCLUDE_OBJECT [NAME=test\\xFC]");
    EXPECT_EQ(read("SET_GCODE_OFFSET X=1\tMOVE=1"), "SET_GCODE_OFFSET [X=1 MOVE=1]");
    EXPECT_EQ(read(std::string(33, 'A')).rfind("error: no command is a word that long", 0), 0U);
}

TEST(Lexer, ACommandKeepsNothingOfTheOneBefore) {
    Command command;
    ASSERT_TRUE(parse_words("M862.3 P\"a\" X1", command).ok());
    ASSERT_TRUE(parse_words("G28", command).ok());
    EXPECT_EQ(describe(command), "G28");
    EXPECT_FALSE(command.subcode);
    EXPECT_TRUE(command.parameters.empty());
}

TEST(Lexer, LeadingCode) {
    EXPECT_EQ(leading_code("m 117 x").letter, 'M');
    EXPECT_EQ(leading_code("m 117 x").number, 117U);
    EXPECT_EQ(leading_code("hello").letter, '\0');
    EXPECT_EQ(leading_code("").letter, '\0');
}

}  // namespace
}  // namespace qduino::printer::gcode::lexer_test
