#include "printer/machine/console.h"

#include <gtest/gtest.h>

#include "tests/unit/gcode/recorder.h"

namespace qduino::printer::machine::console_test {
namespace {

constexpr Console::Situation kFree{};
constexpr Console::Situation kRuns{.job_runs = true};
constexpr Console::Situation kRests{.job_runs = true, .head_rests = true};
constexpr Console::Situation kFaulted{.faulted = true};

bool may(std::string_view line, const Console::Situation& now) {
    const auto parsed = gcode::parse_line(line);
    return Console::may_type(**parsed, now).ok();
}

struct Row {
    const char* name;
    std::vector<std::string> lines;
    bool free, runs, rests, faulted;
};
class ConsoleTable : public testing::TestWithParam<Row> {};

TEST_P(ConsoleTable, DecidesWhatMayBeTypedNow) {
    for (const std::string& line : GetParam().lines) {
        EXPECT_EQ(may(line, kFree), GetParam().free) << line;
        EXPECT_EQ(may(line, kRuns), GetParam().runs) << line;
        EXPECT_EQ(may(line, kRests), GetParam().rests) << line;
        EXPECT_EQ(may(line, kFaulted), GetParam().faulted) << line;
    }
}
INSTANTIATE_TEST_SUITE_P(
    Rows, ConsoleTable,
    testing::Values(
        Row{"Questions", {"M105", "M114", "M115", "M117 hello", "M73 P5", "M112"}, true, true, true, true},
        Row{"Heat",
            {"M104 S200", "M140 S60", "M106 S9", "M107", "M220 S50", "M221 S90"},
            true,
            true,
            true,
            false},
        Row{"Jogs", {"G0 X1", "G1 X1", "G90", "G91", "M82", "M83"}, true, false, true, false},
        Row{"Others",
            {"G28", "M84", "G2 I1", "M109 S9", "M999", "G92 X0", "T0", "HELLO"},
            true,
            false,
            false,
            false}),
    [](const auto& each) { return each.param.name; });

TEST(Console, AFaultWithAJobAtRestTakesNoJogs) {
    EXPECT_FALSE(may("G1 X1", {.faulted = true, .job_runs = true, .head_rests = true}));
    EXPECT_TRUE(may("M105", {.faulted = true, .job_runs = true, .head_rests = true}));
}

TEST(Console, ARefusalNamesTheCodeAndSaysWhy) {
    const auto parsed = gcode::parse_line("G28");
    EXPECT_EQ(Console::may_type(**parsed, kFaulted).error().message.view(),
              "G28 was not done: the machine has a fault; clear it first");
    EXPECT_TRUE(Console::may_type(**parsed, kRuns)
                    .error()
                    .message.view()
                    .starts_with("G28 was not done: a job runs;"));
}

TEST(Console, RunsLinesInTheOrderInWhichTheyWereTyped) {
    gcode::Recorder recorder;
    gcode::Interpreter interpreter(MachineConfig{}, recorder);
    Console console;
    ASSERT_TRUE(console.take("M106 S255").ok());
    ASSERT_TRUE(console.take("; a comment").ok());
    ASSERT_TRUE(console.take("G1 X1.2.3").ok());
    ASSERT_TRUE(console.take("G28").ok());
    std::optional<Result<void>> done = console.run_next(kRuns, interpreter);
    ASSERT_TRUE(done.has_value());
    EXPECT_TRUE(done->ok());
    EXPECT_FALSE(console.run_next(kRuns, interpreter).has_value()) << "nothing to answer";
    EXPECT_FALSE(console.run_next(kRuns, interpreter)->ok()) << "malformed";
    EXPECT_FALSE(console.run_next(kRuns, interpreter)->ok()) << "not while a job runs";
    EXPECT_EQ(recorder.log, (std::vector<std::string>{"fan 0 1"}));
    EXPECT_FALSE(console.waiting());
}

TEST(Console, TakesSixteenLinesAndNoneTooLong) {
    Console console;
    EXPECT_NE(console.take(std::string(257, 'M')).error().message.view().find("256 bytes"),
              std::string_view::npos);
    for (std::size_t i = 0; i < Console::kLinesMax; ++i)
        EXPECT_TRUE(console.take(std::string(256, 'M')).ok());
    EXPECT_NE(console.take("M105").error().message.view().find("busy"), std::string_view::npos);
    console.forget();
    EXPECT_FALSE(console.waiting());
    EXPECT_TRUE(console.take("M105").ok());
}

}  // namespace
}  // namespace qduino::printer::machine::console_test
