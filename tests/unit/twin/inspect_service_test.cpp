#include "inspect/inspect_service.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <vector>

#include "inspect/prefetch_source.h"
#include "tests/unit/twin/pin_player.h"
#include "tests/unit/twin/temporary_folder.h"

namespace qduino::apps::inspect_service_test {
namespace {

using nlohmann::json;
using twin::testing::PinPlayer;
using twin::testing::TemporaryFolder;

struct Bench {
    TemporaryFolder folder;
    twin::Printer printer{twin::Machine{}};
    PinPlayer player{printer};
    InspectService service{printer, [this] { return player.now; }};

    json ask(const std::string& request) { return json::parse(service.answer(request)); }
    json begin(const std::string& job, const std::string& gcode) {
        const std::string path = folder.write("job.gcode", gcode);
        return ask(R"({"op":"job_begin","job":)" + job + R"(,"path":")" + path + "\"}");
    }
    json end(const std::string& job) { return ask(R"({"op":"job_end","job":)" + job + "}"); }
    void go_x(int steps) { player.steps(0, steps > 0 ? 1 : -1, std::abs(steps), Nanoseconds{300'000}); }
};

TEST(InspectService, WatchesAJobFromItsBeginToItsEnd) {
    Bench bench;
    EXPECT_EQ(bench.begin("7", "G1 X1\n"), json::parse(R"({"ok":true,"already":false})"));
    bench.go_x(80);
    const json end = bench.end("7");
    EXPECT_TRUE(end.at("ok"));
    EXPECT_TRUE(end.at("report").at("matches")) << end;
    EXPECT_EQ(end.at("report").at("steps").at("x"), 80);
}

TEST(InspectService, BeginAndEndMayBeRepeated) {
    Bench bench;
    EXPECT_TRUE(bench.begin("7", "G1 X1\n").at("ok"));
    bench.go_x(40);
    EXPECT_TRUE(bench.begin("7", "G1 X1\n").at("already")) << "the watch goes on, it does not start again";
    bench.go_x(40);
    const json first = bench.end("7");
    EXPECT_TRUE(first.at("report").at("matches"));
    bench.go_x(10);
    EXPECT_EQ(bench.end("7"), first);
}

TEST(InspectService, AnotherJobEndsTheOneBeforeAndKeepsItsReport) {
    Bench bench;
    EXPECT_TRUE(bench.begin("1", "G1 X1\n").at("ok"));
    bench.go_x(80);
    EXPECT_TRUE(bench.begin("\"two\"", "G1 X2\n").at("ok"));
    bench.go_x(80);
    EXPECT_TRUE(bench.end("1").at("report").at("matches"));
    EXPECT_TRUE(bench.end("\"two\"").at("report").at("matches")) << "it begins where the first ended";
    EXPECT_FALSE(bench.end("\"1\"").at("ok")) << "7 and \"7\" are two jobs";
}

TEST(InspectService, TheSameJobPrintedAgainIsANewWatch) {
    Bench bench;
    for (int copy = 0; copy < 3; ++copy) {
        EXPECT_FALSE(bench.begin("5", "G1 X1\nG1 X0\n").at("already"));
        bench.go_x(80);
        bench.go_x(-80);
        EXPECT_TRUE(bench.end("5").at("report").at("matches")) << copy;
    }
}

TEST(InspectService, ACancelledJobIsNotCompletedAndTheNextStillMatches) {
    Bench bench;
    bench.begin("1", "G1 X5\nG1 X9\n");
    bench.go_x(400);
    EXPECT_FALSE(bench.end("1").at("report").at("completed"));
    bench.begin("2", "G1 X6\n");
    bench.go_x(80);
    EXPECT_TRUE(bench.end("2").at("report").at("matches"));
}

TEST(InspectService, StateTellsWhatTheMachineDoes) {
    Bench bench;
    bench.player.heat(twin::kHotEnd, 0.5);
    bench.player.wait(60s);
    bench.begin("7", "G1 X1\nG1 X2\n");
    bench.go_x(160);
    const json state = bench.ask(R"({"op":"state"})");
    EXPECT_TRUE(state.at("ok"));
    EXPECT_DOUBLE_EQ(state.at("position_mm").at("x"), 39.3);
    EXPECT_EQ(state.at("steps").at("x"), 160);
    EXPECT_EQ(state.at("lost_steps").at("x"), 0);
    EXPECT_GT(state.at("hot_end").at("c"), 40);
    EXPECT_DOUBLE_EQ(state.at("hot_end").at("duty"), 0.5);
    EXPECT_FALSE(state.at("endstops").at("x"));
    EXPECT_EQ(state.at("job"), 7);
    EXPECT_EQ(state.at("line"), 2);
}

TEST(InspectService, FaultsComeAfterSoManySecondsAndGo) {
    Bench bench;
    bench.player.wait(100s);
    EXPECT_TRUE(bench.ask(R"({"op":"fault","fault":"bus_silent@5"})").at("ok"));
    EXPECT_GE(bench.player.convert(0), 0);
    bench.player.wait(5s);
    EXPECT_EQ(bench.player.convert(0), -1);
    EXPECT_TRUE(bench.ask(R"({"op":"clear_faults"})").at("ok"));
    EXPECT_GE(bench.player.convert(0), 0);
    EXPECT_FALSE(bench.ask(R"({"op":"fault","fault":"gremlins"})").at("ok"));
}

TEST(InspectService, NonsenseIsRefusedAndChangesNothing) {
    Bench bench;
    bench.begin("7", "G1 X1\n");
    for (const char* request :
         {"", "{", "[]", "7", "null", R"({"op":7})", R"({"op":"dance"})", R"({"op":"job_begin"})",
          R"({"op":"job_begin","job":8})", R"({"op":"job_begin","job":8,"path":"/nowhere/at/all"})",
          R"({"op":"job_begin","job":8,"path":"/"})", R"({"op":"job_begin","job":{},"path":"/dev/null"})",
          R"({"op":"job_end","job":99})", R"({"op":"job_end","job":1.5})", "{\"op\":\"\xff\xfe\"}"}) {
        const json answer = bench.ask(request);
        EXPECT_FALSE(answer.at("ok")) << request;
        EXPECT_TRUE(answer.at("error").is_string()) << request;
    }
    bench.go_x(80);
    EXPECT_TRUE(bench.end("7").at("report").at("matches"));
}

TEST(InspectService, KeepsTheLastReportsAndNoMore) {
    Bench bench;
    for (int job = 0; job < 20; ++job) {
        bench.begin(std::to_string(job), "; nothing\n");
        EXPECT_TRUE(bench.end(std::to_string(job)).at("ok"));
    }
    EXPECT_FALSE(bench.end("3").at("ok"));
    EXPECT_TRUE(bench.end("4").at("ok"));
}

TEST(PrefetchSource, GivesTheBytesOfTheFileInOrder) {
    const TemporaryFolder folder;
    std::string text;
    for (int i = 0; text.size() < 6'000'000; ++i) text += "line " + std::to_string(i) + "\n";
    PrefetchSource source(folder.write("large", text));
    ASSERT_TRUE(source.ok());
    std::string read;
    std::vector<char> piece(70'001);
    while (const std::size_t count = source.read(piece)) read.append(piece.data(), count);
    EXPECT_TRUE(read == text);
    EXPECT_EQ(source.read(piece), 0u);
}

TEST(PrefetchSource, MayBeDroppedWhileItReads) {
    const TemporaryFolder folder;
    const std::string path = folder.write("large", std::string(6'000'000, 'x'));
    for (int i = 0; i < 5; ++i) EXPECT_TRUE(PrefetchSource(path).ok());
    EXPECT_FALSE(PrefetchSource(folder / "none").ok());
}

}  // namespace
}  // namespace qduino::apps::inspect_service_test
