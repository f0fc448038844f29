// What of a published guarantee report is handed on: whole reports, and nothing that the page could
// stumble over. The report is made by the very function that the sketch uses.
#include "web/api/guarantee.h"

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <string>
#include <vector>

#include "report/guarantee_report.h"

namespace qduino::web::api::guarantee_test {
namespace {

board::GuaranteeReport report_of_a_printer() {
    board::GuaranteeReport report;
    report.board = "linux, SCHED_FIFO";
    report.watch_cost = 3ms;
    for (const int core : {0, 1}) report.cores.push_back({.core = core, .note = "tick"});
    report.cores[0].interrupts_per_second = 251.5;
    for (const board::VcpuId id : {1, 2, 33}) {
        board::LoopGuarantee loop;
        loop.id = id;
        loop.core = 0;
        loop.budget = 1ms;
        loop.period = 10ms;
        if (id == 1) loop.used = 40ms, loop.watched = 1s, loop.releases = 100;
        report.loops.push_back(loop);
    }
    report.bottom_halves.push_back({.id = 33, .core = 0, .timed = 812});
    report.delays.push_back({.id = 2, .core = 1, .owns_core = true, .worst = 49ms});
    board::TreeGuarantee tree;
    tree.name = "print service";
    report.trees.push_back(tree);
    report.chains.push_back({.name = "thermistors to heaters", .way = "thermistors > loop 3 > heaters"});
    return report;
}

Json json_of_a_printer() { return Json::parse(apps::guarantee_json(report_of_a_printer())); }

bool passes(const Json& report) { return checked_guarantee(text_of(report)).has_value(); }

TEST(CheckedGuarantee, WhatTheSketchWritesPassesAsItIs) {
    const auto passed = checked_guarantee(apps::guarantee_json(report_of_a_printer()));
    ASSERT_TRUE(passed);
    EXPECT_EQ(*passed, json_of_a_printer());
    EXPECT_TRUE(passes(Json::parse(apps::guarantee_json({}))));
}

TEST(CheckedGuarantee, AMemberThatIsMissingOrOfAnotherKindIsRefused) {
    // All that the page reads; what it does not read may be anything that is no table.
    const std::map<std::string, std::vector<std::string>> read{
        {"loops",
         {"id", "core", "budget_us", "period_us", "priority_enforced", "budget_enforced", "core_owned",
          "shortfall", "cpu_used_us", "watched_us", "held_from_outside", "escape", "releases", "overruns",
          "missed", "worst_late_us"}},
        {"cores", {"core", "interrupts_per_second", "worst_gap_us", "counted_per_second", "note"}},
        {"trees", {"name", "core", "budget_us", "period_us", "admitted", "enforced", "shortfall"}},
        {"chains",
         {"name", "way", "reaction_bound_us", "reaction_limit_us", "age_bound_us", "age_limit_us",
          "reactions", "worst_reaction_us", "worst_age_us", "from_first_loop"}}};
    for (const auto& [table, members] : read) {
        for (const std::string& member : members) {
            Json report = json_of_a_printer();
            ASSERT_TRUE(report[table][0].contains(member)) << table << '.' << member;
            report[table][0].erase(member);
            EXPECT_FALSE(passes(report)) << table << '.' << member << " is missing";
            const Json before = json_of_a_printer()[table][0][member];
            for (const Json& wrong : {Json::array(), Json::object(), before.is_string() ? Json(1) : Json("1"),
                                      before.is_boolean() ? Json(nullptr) : Json(-1)}) {
                report[table][0][member] = wrong;
                EXPECT_FALSE(passes(report)) << table << '.' << member << " = " << wrong;
            }
        }
    }
}

TEST(CheckedGuarantee, TablesAreFlatAndBounded) {
    Json report = json_of_a_printer();
    report["loops"][0]["new"] = "a later build's";
    report["also_new"] = 7;
    EXPECT_TRUE(passes(report));
    for (const char* table : {"loops", "cores", "bottom_halves", "delays", "trees", "chains"}) {
        Json without = report;
        without.erase(table);
        EXPECT_FALSE(passes(without)) << table;
        Json deep = report;
        deep[table][0]["new"] = Json::array({1});
        EXPECT_FALSE(passes(deep)) << table;
        Json long_one = report;
        while (long_one[table].size() < kGuaranteeRows) long_one[table].push_back(report[table][0]);
        EXPECT_TRUE(passes(long_one)) << table;
        long_one[table].push_back(report[table][0]);
        EXPECT_FALSE(passes(long_one)) << table;
    }
    report["another"] = Json::array();
    EXPECT_FALSE(passes(report));
}

TEST(CheckedGuarantee, WhateverIsDamagedPassesWholeOrNotAtAll) {
    const unsigned seed = std::random_device{}();
    std::mt19937 dice{seed};
    const std::string whole = apps::guarantee_json(report_of_a_printer());
    for (std::size_t length = 0; length < whole.size(); length += 1 + dice() % 7)
        EXPECT_FALSE(checked_guarantee(std::string_view{whole}.substr(0, length)));
    for (int round = 0; round < 500; ++round) {
        std::string damaged = whole;
        for (int hits = 0; hits < 3; ++hits)
            damaged[dice() % damaged.size()] = static_cast<char>(dice() % 256);
        const auto passed = checked_guarantee(damaged);
        if (!passed) continue;
        const auto again = checked_guarantee(text_of(*passed));
        ASSERT_TRUE(again) << "seed " << seed;
        EXPECT_EQ(*again, *passed) << "seed " << seed;
    }
}

}  // namespace
}  // namespace qduino::web::api::guarantee_test
