#include "board/guarantee_text.h"

#include <gtest/gtest.h>

#include <sstream>

namespace qduino::board {
namespace {

GuaranteeReport example() {
    GuaranteeReport report;
    report.board = "linux, SCHED_FIFO";
    report.memory_locked = true;
    LoopGuarantee loop;
    loop.id = 1;
    loop.budget = 30ms;
    loop.period = 100ms;
    loop.priority_enforced = loop.budget_enforced = true;
    report.loops.push_back(loop);
    loop.id = 2;
    loop.core = 1;
    loop.budget = loop.period = 100us;
    loop.shortfall =
        "its core is open to others and \"everything\" else: let the board isolate it, as root, or boot with "
        "isolcpus=1";
    report.loops.push_back(loop);
    CoreGuarantee core;
    core.core = 1;
    core.interrupts_per_second = 252.4;
    core.worst_gap = 14200ns;
    report.cores.push_back(core);
    core.core = 0;
    core.interrupts_per_second = -1;
    core.worst_gap = Nanoseconds{-1};
    report.cores.push_back(core);
    return report;
}

TEST(GuaranteeText, SaysEachLoopAndCoreInEightyColumns) {
    const std::string text = guarantee_text(example());
    std::istringstream lines{text};
    for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 80u) << line;
    EXPECT_NE(text.find("     1     0  30 ms / 100 ms          enforced  enforced  shared\n"),
              std::string::npos)
        << text;
    EXPECT_NE(text.find("     2     1  100 us / 100 us         enforced  never     not owned\n"),
              std::string::npos)
        << text;
    EXPECT_NE(text.find("  core 1: 252 interrupts/s left, worst gap of a bare spin 14.2 us, tick on\n"),
              std::string::npos)
        << text;
    EXPECT_NE(text.find("  core 0: tick on\n"), std::string::npos) << text;
}

TEST(GuaranteeText, AsJsonIsWhatProgramsRead) {
    EXPECT_EQ(
        guarantee_json(example()),
        R"({"board":"linux, SCHED_FIFO","simulated":false,"memory_locked":true,"loops":[)"
        R"({"id":1,"core":0,"budget_us":30000,"period_us":100000,"priority_enforced":true,"budget_enforced":true,)"
        R"("core_owned":false,"shortfall":""},)"
        R"({"id":2,"core":1,"budget_us":100,"period_us":100,"priority_enforced":true,"budget_enforced":true,)"
        R"("core_owned":false,"shortfall":"its core is open to others and \"everything\" else: let the board isolate )"
        R"(it, as root, or boot with isolcpus=1"}],"cores":[)"
        R"({"core":1,"interrupts_per_second":252.4,"worst_gap_us":14.2,"tick_stopped":false,)"
        R"("throttling_lifted":false,"note":""},)"
        R"({"core":0,"interrupts_per_second":null,"worst_gap_us":null,"tick_stopped":false,)"
        R"("throttling_lifted":false,"note":""}]})");
}

}  // namespace
}  // namespace qduino::board
