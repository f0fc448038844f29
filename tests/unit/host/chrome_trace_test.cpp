// The trace file as a reader of the format sees it.
#include "report/chrome_trace.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "board/sim/sim_board.h"
#include "report/sketch_report.h"

namespace qduino::apps::chrome_trace_test {
namespace {

using board::sim::SimBoard;
using board::sim::TraceKind;

class ChromeTraceTest : public ::testing::Test {
  protected:
    void TearDown() override { std::filesystem::remove(path_); }
    nlohmann::json read() { return nlohmann::json::parse(std::ifstream(path_)); }
    std::filesystem::path path_ =
        std::filesystem::temp_directory_path() / ("chrome-trace-" + std::to_string(::getpid()) + ".json");
};

TEST_F(ChromeTraceTest, StretchesOnTheCpuAreCompleteEventsToTheNanosecond) {
    auto created = ChromeTrace::create(path_);
    ASSERT_TRUE(created);
    ChromeTrace& trace = *created.value();
    const auto event = [&](std::int64_t ns, board::VcpuId vcpu, TraceKind kind) {
        trace.on_event({.time = instant_from_ns(ns), .core = 1, .vcpu = vcpu, .kind = kind});
    };
    event(1'000, 1, TraceKind::run);
    event(2'345, 1, TraceKind::preempt);
    event(2'345, 2, TraceKind::run);
    event(3'000, 4, TraceKind::interrupt);
    event(4'000, 2, TraceKind::throttle);
    event(4'000, 1, TraceKind::run);
    ASSERT_TRUE(trace.finish(instant_from_ns(10'000)));

    std::vector<std::tuple<std::string, int, int, double, double>> stretches;
    int interrupts = 0, interrupt_thread = 0;
    std::map<int, std::string> threads;
    for (const auto& record : read()) {
        if (record["ph"] == "X") {
            stretches.emplace_back(record["name"], record["pid"], record["tid"], record["ts"], record["dur"]);
        }
        if (record["ph"] == "i" && record["name"] == "interrupt") {
            ++interrupts;
            EXPECT_EQ(record["args"]["device"], "nic");
            interrupt_thread = record["tid"];
        }
        if (record["ph"] == "M" && record["name"] == "thread_name")
            threads[record["tid"]] = record["args"]["name"];
    }
    EXPECT_EQ(threads[interrupt_thread], "interrupts");
    EXPECT_EQ(threads[1], "loop 1");
    EXPECT_EQ(stretches,
              (decltype(stretches){
                  {"loop 1", 1, 1, 1.0, 1.345}, {"loop 2", 1, 2, 2.345, 1.655}, {"loop 1", 1, 1, 4.0, 6.0}}));
    EXPECT_EQ(interrupts, 1);
}

TEST_F(ChromeTraceTest, ARunOfTheSimulatorIsTracedWhole) {
    auto created = ChromeTrace::create(path_);
    ASSERT_TRUE(created);
    board::NoPeripherals wires;
    SimBoard board({}, wires, created.value().get());
    board::VcpuSpec spec;
    spec.id = 1;
    spec.budget = 30ms;
    spec.period = 100ms;
    spec.core = 0;
    spec.entry = [](void* b) { static_cast<SimBoard*>(b)->busy_until(kForever); };
    spec.context = &board;
    ASSERT_TRUE(board.start({&spec, 1}));
    board.run(kEpoch + 950ms);
    ASSERT_TRUE(created.value()->finish(board.now()));
    double busy_us = 0;
    for (const auto& record : read()) {
        if (record["ph"] == "X") busy_us += record["dur"].get<double>();
    }
    EXPECT_DOUBLE_EQ(busy_us, 300'000);
}

TEST(ChromeTraceFile, APathThatCannotBeWrittenIsAnErrorThatNamesIt) {
    const auto created = ChromeTrace::create("/nonexistent/trace.json");
    ASSERT_FALSE(created);
    EXPECT_NE(created.error().message.view().find("/nonexistent/trace.json"), std::string_view::npos);
}

TEST(LoopTable, SaysWhatEachLoopDid) {
    runtime::Loop loop;
    loop.declaration.id = 3;
    loop.statistics.passes.add(12);
    loop.statistics.releases.add(10);
    loop.statistics.overruns.add(2);
    loop.statistics.lateness_ns_max.raise_to(1'500'000);
    loop.statistics.release_latency_ns.record(250);
    const std::string table = loop_table({&loop});
    const std::string line = table.substr(table.find('\n') + 1);
    for (const char* part : {"3", "12", "10", "2", "1.5 ms", "250 ns"})
        EXPECT_NE(line.find(part), std::string::npos) << part;
}

}  // namespace
}  // namespace qduino::apps::chrome_trace_test
