// The commands of qduino as its parser has them, and the completion scripts that are made of it.
#include <gtest/gtest.h>

#include "qduino/command_set.h"
#include "qduino/completion.h"
#include "terminal/parser.h"

namespace qduino::apps::completion_test {
namespace {

class CompletionTest : public ::testing::Test {
  protected:
    CommandSet commands_;
    CLI::App* parser_ = &commands_.parser();
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

class CommandsTest : public CompletionTest {
  protected:
    void parse(const std::string& line) { parser_->parse(line, false); }
};

TEST_F(CommandsTest, TheHelpHasThemInTheirOrder) {
    std::string names;
    for (const CLI::App* command : std::as_const(*parser_).get_subcommands({}))
        names += command->get_name() + ' ';
    EXPECT_EQ(names,
              "new build size run sim check trace profile vcpu metal lib upload monitor ide doctor restore "
              "completion ");
}

TEST_F(CommandsTest, TheLineChoosesOne) {
    parse("run blinker --for 2.5 --isolate --best-effort --report r.json");
    EXPECT_EQ(commands_.chosen(), commands_.find("run"));
    EXPECT_EQ(commands_.find("runs"), nullptr);
}

TEST_F(CommandsTest, WhatMayLookLikeOptionsIsNotParsed) {
    const auto left = [this](const std::string& name, const std::vector<std::string>& words) {
        return commands_.find(name)->take_words(*parser_->get_subcommand(name), words);
    };
    EXPECT_EQ(left("vcpu", {"--core", "0", "-q", "make", "-j4"}), 3U);
    EXPECT_EQ(left("vcpu", {"--", "--core"}), 0U);
    EXPECT_EQ(left("vcpu", {"--core"}), 1U);
    EXPECT_EQ(left("ide", {"compile", "-x", "c++"}), 1U);
    EXPECT_EQ(left("ide", {"install", "book", "--to", "a@b"}), 4U);
    EXPECT_EQ(left("sim", {"blinker", "--for", "1"}), 3U);
}

TEST_F(CommandsTest, WrongOnesAreRefused) {
    for (const char* line : {"", "sim --cores 0", "sim --for -1", "sim --for 0", "run --speed 2",
                             "build --only avr", "run --board /nonexistent.toml", "completion tcsh", "new"}) {
        EXPECT_THROW(parse(line), CLI::ParseError) << line;
        parser_->clear();
    }
}

}  // namespace
}  // namespace qduino::apps::completion_test
