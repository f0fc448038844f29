
#include <gtest/gtest.h>

#include "qduino/arguments.h"
#include "terminal/parser.h"

namespace qduino::apps::completion_test {
namespace {

class CompletionTest : public ::testing::Test {
  protected:
    Arguments arguments_;
    std::unique_ptr<CLI::App> parser_ = make_parser(arguments_);
    bool has(const std::string& shell, const std::string& text) const {
        return completion_script(*parser_, shell).find(text) != std::string::npos;
    }
};

TEST_F(CompletionTest, KnowsEveryCommandAndEveryOption) {
    for (const CLI::App* command : std::as_const(*parser_).get_subcommands({})) {
        for (const char* shell : {"bash", "zsh", "fish"})
            EXPECT_TRUE(has(shell, command->get_name())) << shell;
        for (const CLI::Option* option : command->get_options()) {
            for (const std::string& name : option->get_lnames()) {
                EXPECT_TRUE(has("bash", "--" + name)) << name;
                EXPECT_TRUE(has("zsh", "'--" + name + "[")) << name;
                EXPECT_TRUE(has("fish", " -l " + name)) << name;
            }
        }
    }
}

TEST_F(CompletionTest, KnowsWhichOptionsTakeAValue) {
    EXPECT_TRUE(has("zsh", "'--board[Board file (docs/board-file.md)]:value:_files'"));
    EXPECT_TRUE(has("zsh", "'--verbose[Show the commands that build it]'"));
    EXPECT_TRUE(has("zsh", "'--only[One board\\: sim or linux]:board:(sim linux)'"));
    EXPECT_TRUE(has("fish", "-l for -r -d 'Virtual seconds (default 10)'"));
    EXPECT_TRUE(has("fish", "-l isolate -d "));
}

TEST_F(CompletionTest, OtherShellsHaveNone) { EXPECT_EQ(completion_script(*parser_, "tcsh"), ""); }

class ArgumentsTest : public CompletionTest {
  protected:
    void parse(const std::string& line) { parser_->parse(line, false); }
};

TEST_F(ArgumentsTest, EachCommandTakesWhatIsItsOwn) {
    parse("run blinker --for 2.5 --isolate --best-effort --report r.json");
    EXPECT_EQ(arguments_.command, Command::run);
    EXPECT_EQ(arguments_.sketch, "blinker");
    EXPECT_EQ(arguments_.length_s, 2.5);
    EXPECT_TRUE(arguments_.isolate && arguments_.best_effort);
    EXPECT_EQ(arguments_.report, "r.json");
    EXPECT_FALSE(arguments_.cores);
}

TEST_F(ArgumentsTest, WhatIsLeftOutIsTheDefault) {
    parse("check --cores 1");
    EXPECT_EQ(arguments_.command, Command::check);
    EXPECT_EQ(arguments_.sketch, ".");
    EXPECT_EQ(arguments_.cores, 1);
    EXPECT_FALSE(arguments_.seed);
}

TEST_F(ArgumentsTest, WrongOnesAreRefused) {
    for (const char* line : {"", "sim --cores 0", "sim --for -1", "sim --for 0", "run --speed 2",
                             "build --only avr", "run --board /nonexistent.toml", "completion tcsh", "new"}) {
        EXPECT_THROW(parse(line), CLI::ParseError) << line;
        parser_->clear();
    }
}

}  // namespace
}  // namespace qduino::apps::completion_test
