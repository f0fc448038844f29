// A loop that does not want to keep to its budget gets no more, by the kernel's own account; and
// the report names it. One second for each of some ways; bench-escape has all of them, for longer.
#include <gtest/gtest.h>
#include <sched.h>
#include <unistd.h>

#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "bench/escape/judge.h"
#include "board/linux/kernel/real_time_thread.h"

namespace qduino::board::linux::test::escape_test {
namespace {

using bench::EscapeRun;
using bench::kEscapeeShare;

/// In a second, an account that begins full and a reading that is a tick old are 2 %; a busy
/// computer's late looks, the same again.
constexpr double kMargin = 0.06;

bool has_real_time() {
    const sched_param lowest{.sched_priority = 1};
    const bool granted = ::sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &lowest) == 0;
    const sched_param ordinary{};
    ::sched_setscheduler(0, SCHED_OTHER | SCHED_RESET_ON_FORK, &ordinary);
    return granted;
}

/// Where the warden looks late, as on a busy computer, it stops the loop for longer: over a longer
/// time the share comes back to the budget. Without a warden no length of time helps.
EscapeRun run_watched(const char* pattern, Nanoseconds length = 1s) {
    EscapeRun run = bench::run_escape(ESCAPE_PATTERNS, pattern, length, true);
    if (run.trouble.empty() && run.share > kEscapeeShare + kMargin)
        run = bench::run_escape(ESCAPE_PATTERNS, pattern, 6s, true);
    return run;
}

class AnEscape : public ::testing::TestWithParam<const char*> {
  protected:
    void SetUp() override {
        if (!has_real_time() || cpu_count() < 2) GTEST_SKIP() << "needs real-time priorities and two cores";
    }
    static nlohmann::json loops_in(const EscapeRun& run) {
        const auto report = nlohmann::json::parse(run.report, nullptr, false);
        return report.is_object() ? report["loops"] : nlohmann::json::array();
    }
};

TEST_P(AnEscape, GetsNoMoreThanItsBudgetAndIsNamed) {
    const EscapeRun run = run_watched(GetParam());
    ASSERT_EQ(run.trouble, "");
    EXPECT_LE(run.share, kEscapeeShare + kMargin);
    const auto loops = loops_in(run);
    ASSERT_EQ(loops.size(), 3u) << run.report;
    if (loops[0]["shortfall"].get<std::string>().find("ptrace") != std::string::npos)
        GTEST_SKIP() << "threads cannot be stopped here: " << loops[0]["shortfall"];
    EXPECT_NE(loops[0]["escape"], "") << run.report;
    EXPECT_EQ(loops[0]["budget_enforced"], false) << run.report;
    EXPECT_EQ(loops[1]["escape"], "") << run.report;
    EXPECT_EQ(loops[2]["escape"], "") << run.report;
}

INSTANTIATE_TEST_SUITE_P(Of, AnEscape,
                         ::testing::Values("blocked_signals", "own_handler", "deleted_timers", "jump_out",
                                           "raised_priority", "another_core", "killed_warden",
                                           "long_system_calls", "descriptor_owner", "written_over",
                                           "first_to_die", "frozen_warden"),
                         [](const auto& tested) { return std::string(tested.param); });

class ARefusal : public AnEscape {};

TEST_P(ARefusal, LeavesALoopThatKeepsToItsBudget) {
    const EscapeRun run = run_watched(GetParam());
    ASSERT_EQ(run.trouble, "");
    EXPECT_LE(run.share, kEscapeeShare + kMargin);
    const auto loops = loops_in(run);
    ASSERT_EQ(loops.size(), 3u) << run.report;
    EXPECT_EQ(loops[0]["escape"], "") << run.report;
}

INSTANTIATE_TEST_SUITE_P(Of, ARefusal, ::testing::Values("new_threads", "fork", "vfork_exec"),
                         [](const auto& tested) { return std::string(tested.param); });

/// setup()'s threads and processes are in nobody's budget. The report names who ran in front of
/// loops.
class AStranger : public AnEscape {};

TEST_P(AStranger, GetsNoMoreAndIsNamed) {
    const EscapeRun run = run_watched(GetParam(), 2s);  // some begin a second after setup()
    ASSERT_EQ(run.trouble, "");
    const auto report = nlohmann::json::parse(run.report, nullptr, false);
    ASSERT_TRUE(report.is_object()) << run.report;
    // The holder of a lock runs on as an ordinary thread: then nothing else tells what it was lent.
    const auto& loop = report["loops"][0];
    const double charged = loop["cpu_used_us"].get<double>() / loop["watched_us"].get<double>();
    EXPECT_LE(std::string{GetParam()} == "lent_priority" ? charged : run.share, kEscapeeShare + kMargin);
    const std::map<std::string, std::string> names{
        {"lent_priority", "'pi-holder'"},
        {"ranked_thread", "'usurper'"},
        {"ranked_child", "'ranked-child'"},
        {"ranked_orphan", "'ranked-orphan'"},
        {"ranked_children", "so were all others that are no loops"}};
    EXPECT_NE(report["intruders"].get<std::string>().find(names.at(GetParam())), std::string::npos)
        << run.report;
}

INSTANTIATE_TEST_SUITE_P(Of, AStranger,
                         ::testing::Values("lent_priority", "ranked_thread", "ranked_child", "ranked_orphan",
                                           "ranked_children"),
                         [](const auto& tested) { return std::string(tested.param); });

TEST_F(AnEscape, WithoutTheWardenIsSeenByTheJudge) {
    const EscapeRun run = bench::run_escape(ESCAPE_PATTERNS, "blocked_signals", 1s, false);
    ASSERT_EQ(run.trouble, "");
    EXPECT_GT(run.share, kEscapeeShare + kMargin);
    const auto loops = loops_in(run);
    ASSERT_EQ(loops.size(), 3u) << run.report;
    EXPECT_EQ(loops[0]["budget_enforced"], false) << run.report;
}

}  // namespace
}  // namespace qduino::board::linux::test::escape_test
