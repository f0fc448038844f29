#include "report/picture/strip.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "report/picture/recorder.h"

namespace qduino::apps::picture::strip_test {
namespace {

using ::testing::HasSubstr;

std::size_t columns(std::string_view line) {
    return static_cast<std::size_t>(std::ranges::count_if(line, [](char c) { return (c & 0xC0) != 0x80; }));
}

Schedule schedule() {
    Recorder recorder(kEpoch, kEpoch + 66ms);  // a column is 1 ms
    recorder.released(0, 1, kEpoch, kEpoch + 20ms);
    recorder.does(0, 1, Doing::runs, kEpoch);
    recorder.does(0, 1, Doing::throttled, kEpoch + 4500us);
    recorder.does(0, 1, Doing::runs, kEpoch + 10ms);
    recorder.does(0, 1, Doing::nothing, kEpoch + 30ms);
    recorder.ended(1, kEpoch + 30ms);
    recorder.does(0, 12, Doing::waits, kEpoch + 28ms);
    recorder.does(0, 12, Doing::runs, kEpoch + 30ms);
    recorder.does(0, 12, Doing::nothing, kEpoch + 30100us);
    Schedule made = recorder.finish(kEpoch + 66ms);
    made.responses = {{"loop 1", 5ms, 20ms, 10ms, 30ms}, {"loop 12", 1ms, 8ms, {}, {}}};
    return made;
}

TEST(Strip, ShowsWhatEachDid) {
    EXPECT_EQ(strip(schedule(), Signs::blocks),
              "core 0\n"
              "  loop 1  ████▄░░░░░██████████!█████████\n"
              "  loop 12                             ··▁\n"
              "          |0        |10 ms    |20 ms    |30 ms    |40 ms    |50 ms    |60 ms\n"
              "  █ runs   ░ throttled: its budget is spent   · waits   ! misses its deadline\n"
              "\n"
              "C █, R ▒, of one period T:\n"
              "  loop 1  █████████▒▒▒▒▒▒▒▒▒··················│ R 10 ms of T 20 ms, seen 30 ms\n"
              "  loop 12 █████▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒▒! R never ends, T 8 ms\n");
}

TEST(Strip, TakesAsciiWhereTheTerminalHasNothingElse) {
    const std::string text = strip(schedule(), Signs::ascii);
    EXPECT_THAT(text, HasSubstr("  loop 1  ####oxxxxx##########!#########\n"));
    EXPECT_THAT(text, HasSubstr("  loop 1  #########=========..................| R 10 ms"));
    EXPECT_TRUE(std::ranges::all_of(text, [](char c) { return c == '\n' || (c >= ' ' && c <= '~'); }));
}

TEST(Strip, ShowsPinsAsALogicAnalyserDoes) {
    Schedule made;
    made.from = kEpoch;
    made.pins_until = made.until = kEpoch + 66ms;
    made.pins = {{.name = "pin 4",
                  .remark = "",
                  .stretches = {{kEpoch, kEpoch + 3ms, 1}, {kEpoch + 3ms, kEpoch + 10ms, 0}}},
                 {.name = "pin 5", .remark = "", .stretches = {{kEpoch + 2ms, kEpoch + 9ms, 0.5}}},
                 {.name = "pin 6",
                  .remark = "",
                  .stretches = {{kEpoch, kEpoch + 2500us, 0},
                                {kEpoch + 2500us, kEpoch + 2500us, 1},
                                {kEpoch + 2500us, kEpoch + 6ms, 0}}}};
    const std::string axis = "          |0        |10 ms    |20 ms    |30 ms    |40 ms    |50 ms    |60 ms\n";
    EXPECT_EQ(strip(made, Signs::ascii),
              "pins\n  pin 4   ---_______\n  pin 5     ooooooo\n  pin 6   __#___\n" + axis +
                  "  - high   _ low   # both, too quick to draw   o PWM, as high as its duty\n");
    for (int i = 0; i < 20; ++i) made.pins.push_back({.name = "pin 9", .remark = "", .stretches = {}});
    EXPECT_THAT(strip(made, Signs::blocks), HasSubstr("  and 11 more\n"));
    Schedule both = schedule();
    both.pins = {made.pins[0]};
    both.pins_until = both.until;
    EXPECT_EQ(strip(both, Signs::blocks).find("|10 ms"), strip(both, Signs::blocks).rfind("|10 ms"))
        << "one axis";
    both.pins_until = both.until + 1s;
    EXPECT_NE(strip(both, Signs::blocks).find("|0 "), strip(both, Signs::blocks).rfind("|0 ")) << "its own";
}

TEST(Strip, FitsATerminal) {
    for (const Instant from : {kEpoch, kEpoch + 12345678us, kEpoch + 86'399s}) {
        for (const Nanoseconds length :
             std::initializer_list<Nanoseconds>{700ns, 3us, 1234us, 66ms, 1700ms, 3600s}) {
            Recorder recorder(from, from + length);
            for (VcpuId id = 21; id <= 32; ++id) recorder.declare({id, 99'999us, 100'001us, 40}, false);
            Schedule made = recorder.finish(from + length);
            made.responses = {{"loop 32", 99'999us, 100'001us, 123'456'789us, 1'234'567us}};
            std::istringstream lines(strip(made, Signs::blocks));
            int count = 0;
            for (std::string line; std::getline(lines, line); ++count) EXPECT_LE(columns(line), 80u) << line;
            EXPECT_GT(count, 12);
        }
    }
}

TEST(Strip, IsEmptyWhereItWouldFillTheScreen) {
    Recorder recorder(kEpoch, kEpoch + 1s);
    EXPECT_EQ(strip(recorder.finish(kEpoch + 1s), Signs::ascii), "");
    Recorder many(kEpoch, kEpoch + 1s);
    for (VcpuId id = 1; id <= 13; ++id) many.declare({id, 1ms, 10ms, 0}, false);
    EXPECT_EQ(strip(many.finish(kEpoch + 1s), Signs::ascii), "");
}

TEST(Strip, AsksTheLocaleForItsSigns) {
    for (const char* name : {"LC_ALL", "LC_CTYPE", "LANG"}) ::unsetenv(name);
    EXPECT_EQ(signs_of_terminal(), Signs::ascii);
    ::setenv("LANG", "de_DE.UTF-8", 1);
    EXPECT_EQ(signs_of_terminal(), Signs::blocks);
    ::setenv("LC_ALL", "C", 1);
    EXPECT_EQ(signs_of_terminal(), Signs::ascii) << "it overrules LANG";
    ::setenv("LC_ALL", "C.utf8", 1);
    EXPECT_EQ(signs_of_terminal(), Signs::blocks);
    ::unsetenv("LC_ALL");
}

}  // namespace
}  // namespace qduino::apps::picture::strip_test
