#include "printer/gcode/parser.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace qduino::printer::gcode::parser_test {
namespace {

class Names {
  public:
    void operator()(const Line& line) {
        seen.push_back(line.error                ? "error"
                       : line.command != nullptr ? std::string(line.command->name().view())
                                                 : ";" + std::string(line.comment));
    }
    std::vector<std::string> seen;
};

TEST(Parser, PushesEveryLineInOrder) {
    Parser parser;
    Names names;
    for (const std::string_view piece : {"G28 ; home\nG1 X", "1\n;LAY", "ER:1\n\nG1 X--\nM84"}) {
        parser.feed({piece.data(), piece.size()}, names);
    }
    parser.finish(names);
    EXPECT_EQ(names.seen, (std::vector<std::string>{"G28", "G1", ";LAYER:1", ";", "error", "M84"}));
}

TEST(Parser, PullLeavesTheRestWithTheCaller) {
    Parser parser;
    const std::string text = "G1 X1\nG1 X2\nG1";
    std::span<const char> input{text.data(), text.size()};
    const Line* line = parser.next(input);
    ASSERT_NE(line, nullptr);
    EXPECT_EQ(line->command->parameters.value('X'), 1.0);
    EXPECT_EQ(input.size(), 8U);
    line = parser.next(input);
    ASSERT_NE(line, nullptr);
    EXPECT_EQ(line->command->source, (Source{6, 12, 2, 5}));
    EXPECT_EQ(parser.next(input), nullptr);
    EXPECT_TRUE(input.empty());
    line = parser.finish();
    ASSERT_NE(line, nullptr);
    EXPECT_EQ(line->command->name().view(), "G1");
    EXPECT_EQ(parser.finish(), nullptr);
}

TEST(Parser, AnErrorNamesLineAndByte) {
    Parser parser;
    const std::string text = "G28\nG1 X1.2.3\n";
    std::span<const char> input{text.data(), text.size()};
    (void)parser.next(input);
    const Line* line = parser.next(input);
    ASSERT_TRUE(line != nullptr && line->error);
    EXPECT_EQ(line->command, nullptr);
    EXPECT_EQ(line->error->message.view(), "line 2, byte 4: expected a letter at '.3'");
    EXPECT_EQ(line->text, "G1 X1.2.3");
}

TEST(Parser, ACommandMayBeKept) {
    Parser parser;
    Command kept;
    std::string text = "M117 hold this\n";
    std::span<const char> input{text.data(), text.size()};
    kept = *parser.next(input)->command;
    text.assign(text.size(), 'x');
    const std::string_view other = "M117 another\n";
    input = {other.data(), other.size()};
    (void)parser.next(input);
    EXPECT_EQ(kept.text.view(), "hold this");
}

TEST(ParseLine, TakesExactlyOneLine) {
    EXPECT_EQ((*parse_line("G28 X"))->name().view(), "G28");
    EXPECT_EQ((*parse_line("G28 X\n"))->name().view(), "G28");
    EXPECT_EQ((*parse_line("G28 X\r\n"))->name().view(), "G28");
    EXPECT_FALSE(parse_line("; only this")->has_value());
    EXPECT_FALSE(parse_line("")->has_value());
    EXPECT_FALSE(parse_line("G28\nG1 X5").ok());
    EXPECT_FALSE(parse_line("G28\n\n").ok());
    EXPECT_FALSE(parse_line("G1 X--").ok());
}

}  // namespace
}  // namespace qduino::printer::gcode::parser_test
