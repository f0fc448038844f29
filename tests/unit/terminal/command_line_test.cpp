#include "terminal/command_line.h"

#include <gtest/gtest.h>

#include <optional>
#include <string>

namespace qduino::apps::command_line_test {
namespace {

/// What is said when `word` is the value of an option that takes 0.01 to 10000, or 1 to 65535 of
/// whole numbers; empty: it is taken.
template <typename Number>
std::string said_of(const char* word, Number least, Number most) {
    CommandLine line{"Plays the printer."};
    line.name("player");
    Number value{};
    line.option("--speed", value, "Factor").within(least, most);
    const char* const words[] = {"player", "--speed", word};
    testing::internal::CaptureStderr();
    const std::optional<int> status = line.parse(3, words);
    const std::string said = testing::internal::GetCapturedStderr();
    EXPECT_EQ(status.has_value(), !said.empty()) << said;
    EXPECT_TRUE(!status || *status > 100);
    return said.substr(0, said.find('\n'));
}

TEST(CommandLine, NumbersOutsideTheirRangeAreRefusedByWordsAPersonReads) {
    EXPECT_EQ(said_of("0", 0.01, 10000.0), "player: --speed: '0' is not a number from 0.01 to 10000");
    EXPECT_EQ(said_of("fast", 0.01, 10000.0), "player: --speed: 'fast' is not a number from 0.01 to 10000");
    EXPECT_EQ(said_of("nan", 0.01, 10000.0), "player: --speed: 'nan' is not a number from 0.01 to 10000");
    EXPECT_EQ(said_of("20x", 0.01, 10000.0), "player: --speed: '20x' is not a number from 0.01 to 10000");
    EXPECT_EQ(said_of("20.5", 0.01, 10000.0), "");
    EXPECT_EQ(said_of("10000", 0.01, 10000.0), "");
}

TEST(CommandLine, WholeNumbersOutsideTheirRangeAreRefusedByWordsAPersonReads) {
    EXPECT_EQ(said_of("0", 1, 65535), "player: --speed: '0' is not a whole number from 1 to 65535");
    EXPECT_EQ(said_of("2.5", 1, 65535), "player: --speed: '2.5' is not a whole number from 1 to 65535");
    EXPECT_EQ(said_of("99999999999999999999", 1, 65535),
              "player: --speed: '99999999999999999999' is not a whole number from 1 to 65535");
    EXPECT_EQ(said_of("65535", 1, 65535), "");
}

}  // namespace
}  // namespace qduino::apps::command_line_test
