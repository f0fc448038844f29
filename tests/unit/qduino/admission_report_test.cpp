#include "report/admission_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace qduino::apps::admission_report_test {
namespace {

using nlohmann::json;
using runtime::LoopDeclaration;
using runtime::Plan;
using runtime::SketchTable;
using ::testing::HasSubstr;
using ::testing::Not;

SketchTable sketch(std::initializer_list<LoopDeclaration> loops) {
    SketchTable table;
    for (LoopDeclaration loop : loops) {
        loop.body = [] {};
        loop.file = "/home/me/a/a.ino";
        loop.line = 10 + loop.id;
        table.loops.push_back(loop);
    }
    return table;
}

LoopDeclaration loop(board::VcpuId id, Nanoseconds budget, Nanoseconds period, int core = runtime::kAnyCore) {
    return {{id, budget, period, core}};
}

/// The loops of `table` and what `setup` adds, judged.
Plan plan_for(int cores, const SketchTable& table, const sched::PlatformOverheads& overheads = {},
              const std::function<void(Plan&)>& setup = {}) {
    Plan plan(true);
    if (!plan.add_loops(table)) return plan;
    if (setup) setup(plan);
    static_cast<void>(
        plan.admit(std::vector<sched::PlatformOverheads>(static_cast<std::size_t>(cores), overheads)));
    return plan;
}

std::size_t longest_line(const std::string& text) {
    std::size_t longest = 0;
    for (std::size_t from = 0; from < text.size();) {
        const std::size_t end = text.find('\n', from);
        longest = std::max(longest, end - from);
        from = end + 1;
    }
    return longest;
}

TEST(AdmissionReport, AnAdmittedSketchIsATable) {
    const SketchTable table = sketch({loop(1, 30ms, 100ms, 0), loop(2, 100us, 100us, 1), loop(3, 4ms, 10ms)});
    const Plan plan = plan_for(2, table, {}, [](Plan& of) { ASSERT_TRUE(of.add_io(1ms, 100ms, 0)); });
    const CheckedBoard board{.sketch = "a", .board_file = "", .cores = 2, .setup_ran = true};
    EXPECT_TRUE(all_admitted(plan));
    EXPECT_EQ(admission_text(plan, table, board),
              "a: admitted on 2 cores\n"
              "\n"
              "VCPU     core        budget        period             R  declared at\n"
              "loop 1      0         30 ms        100 ms  58685.859 us  a.ino:11\n"
              "loop 2      1        100 us        100 us        100 us  a.ino:12\n"
              "loop 3      0          4 ms         10 ms          4 ms  a.ino:13\n"
              "io 33       0          1 ms        100 ms        8.1 ms  setup()\n"
              "\n"
              "core 0: admitted, utilisation 0.7199: even at worst, each ends in time (R <= T)\n"
              "  loop 3   R 4 ms of T 10 ms\n"
              "  loop 1   R 58.686 ms of T 100 ms\n"
              "core 1: admitted, owned by loop 2: it is alone there and never throttled\n"
              "  loop 2   R 100 us of T 100 us\n"
              "\n"
              "Counted here: the loops alone. A real computer takes time as well (to switch\n"
              "between loops, for interrupts), and R is longer there: --board FILE counts it.\n"
              "A sleep within a release (delay()) is in R only if it is declared. Room for it:\n"
              "  loop 1 24.9 ms, loop 3 6 ms.\n"
              "setup() was run, with nothing wired: it may declare I/O VCPUs.\n");
    const json report = json::parse(admission_json(plan, table, board));
    EXPECT_EQ(report["io"][0]["id"], 33);
    EXPECT_EQ(report["cores"][1]["by"], "owned");
    EXPECT_EQ(report["loops"][2]["response_ns"], 4'000'000);
    EXPECT_EQ(report["loops"][0]["line"], 11);
}

TEST(AdmissionReport, OverheadsThatWereCountedAreNamed) {
    sched::PlatformOverheads overheads{.release_cost = 20us, .enforcement_cost = 30us, .interferers = {}};
    overheads.interferers.push_back({"interrupts", 10us, 1ms, 0ns});
    const SketchTable table = sketch({loop(1, 3ms, 10ms, 0)});
    const Plan plan = plan_for(1, table, overheads);
    const CheckedBoard board{.sketch = "a", .board_file = "b.toml", .cores = 1};
    const std::string text = admission_text(plan, table, board);
    EXPECT_THAT(text, HasSubstr("a: admitted on 1 core of b.toml\n"));
    EXPECT_THAT(text, HasSubstr("Overheads counted, from the board file:\n"
                                "  core 0: 20 us per release, 30 us per enforcement\n"
                                "    interrupts: 10 us every 1 ms\n"));
    const json report = json::parse(admission_json(plan, table, board));
    EXPECT_EQ(report["overheads"][0],
              json::parse(R"({"core":0,"release_ns":20000,"enforcement_ns":30000,"interferers":[
                  {"name":"interrupts","cost_ns":10000,"interval_ns":1000000,"jitter_ns":0}]})"));
    EXPECT_EQ(report["board"]["file"], "b.toml");
}

TEST(AdmissionReport, ABurstHasItsSecondPair) {
    sched::PlatformOverheads overheads;
    overheads.interferers.push_back({"interrupts", 10us, 1ms, 4ms, 0, 100us, 1ms});
    const SketchTable table = sketch({loop(1, 3ms, 10ms, 0)});
    const CheckedBoard board{.sketch = "a", .board_file = "b.toml", .cores = 1};
    const json report = json::parse(admission_json(plan_for(1, table, overheads), table, board));
    EXPECT_EQ(report["overheads"][0]["interferers"][0],
              json::parse(R"({"name":"interrupts","cost_ns":10000,"interval_ns":1000000,
                  "jitter_ns":4000000,"peak_interval_ns":100000,"peak_jitter_ns":1000000})"));
}

TEST(AdmissionReport, ALoopThatIsNeverDoneSaysSo) {
    const SketchTable table = sketch({loop(1, 9ms, 10ms, 0), loop(2, 5ms, 20ms, 0)});
    const Plan plan = plan_for(1, table);
    const CheckedBoard board{.sketch = "a", .board_file = "", .cores = 1};
    EXPECT_FALSE(all_admitted(plan));
    const std::string text = admission_text(plan, table, board);
    EXPECT_THAT(text, HasSubstr("a: REFUSED on 1 core\n"));
    EXPECT_THAT(text, HasSubstr("loop 2      0          5 ms         20 ms"));
    EXPECT_THAT(text, HasSubstr("loop 2 (5 ms in 20 ms) is refused on core 0:\n"));
    const json refusal = json::parse(admission_json(plan, table, board))["refusals"][0];
    EXPECT_EQ(refusal["late_loop"], 2);
    EXPECT_EQ(refusal["because"], "completion_time");
    EXPECT_EQ(refusal["smallest_change"]["budget_ns"], 2'000'000);
}

TEST(AdmissionReport, AnIoVcpuThatDoesNotFitIsRefusedByName) {
    const SketchTable table = sketch({loop(1, 40ms, 100ms, 0)});
    const Plan plan = plan_for(1, table, {}, [](Plan& of) { ASSERT_TRUE(of.add_io(61ms, 100ms, 0)); });
    const CheckedBoard board{.sketch = "a", .board_file = "", .cores = 1, .setup_ran = true};
    EXPECT_FALSE(all_admitted(plan));
    const std::string text = admission_text(plan, table, board);
    EXPECT_THAT(text, HasSubstr("a: REFUSED on 1 core\n"));
    EXPECT_THAT(text, HasSubstr("I/O VCPU 33 (61 ms in 100 ms) is refused on core 0:\n"
                                "  I/O VCPU 33 would be served late for a loop of its core:\n"));
    const json report = json::parse(admission_json(plan, table, board));
    EXPECT_FALSE(report["admitted"]);
    EXPECT_EQ(report["io"][0]["id"], 33);
    EXPECT_EQ(report["refusals"][0]["because"], "late_service");
    EXPECT_EQ(report["refusals"][0]["late_loop"], 33);
}

TEST(AdmissionReport, WhatNeverGotAsFarAsAdmissionHasItsReason) {
    SketchTable table = sketch({loop(1, 1ms, 10ms), loop(1, 2ms, 10ms)});
    const Plan plan = plan_for(1, table);
    const CheckedBoard board{.sketch = "a", .board_file = "", .cores = 1};
    EXPECT_THAT(admission_text(plan, table, board), HasSubstr("loop 1 was declared before"));
    const json report = json::parse(admission_json(plan, table, board));
    EXPECT_FALSE(report["admitted"]);
    EXPECT_THAT(report["explanation"].get<std::string>(), HasSubstr("loop 1 was declared before"));
    EXPECT_TRUE(report["loops"].empty());
}

TEST(AdmissionReport, LongNamesDoNotBreakTheTable) {
    SketchTable table = sketch({loop(32, 1000001us, 24h, 0)});
    table.loops[0].file = "/a/sketch_with_a_name_that_is_too_long_for_its_column.ino";
    const Plan plan = plan_for(1, table);
    const CheckedBoard board{.sketch = "a", .board_file = "", .cores = 1};
    const std::string text = admission_text(plan, table, board);
    EXPECT_LE(longest_line(text), 80u) << text;
    EXPECT_THAT(text, Not(HasSubstr("column.ino")));
}

}  // namespace
}  // namespace qduino::apps::admission_report_test
