// What the guarantee report says of bottom halves: their promise and what became of it, and the
// kernel's threads on their budget.
#include "apps/guarantee/guarantee_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace qduino::apps::guarantee_report_test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

/// The words, whatever lines they stand on.
std::string in_one_line(std::string text) {
    for (char& c : text) c = c == '\n' ? ' ' : c;
    return text;
}

board::GuaranteeReport report_of(Nanoseconds end_worst) {
    board::GuaranteeReport report;
    report.bottom_halves.push_back({.id = 33,
                                    .core = 1,
                                    .timed = 812,
                                    .untimed = 0,
                                    .begin_median = 20us,
                                    .begin_p999 = 60us,
                                    .begin_worst = 70us,
                                    .end_worst = end_worst,
                                    .response = 2ms,
                                    .replenishment = 8ms});
    return report;
}

std::string said_of(Nanoseconds end_worst) { return in_one_line(handlers_kept(report_of(end_worst))); }

TEST(GuaranteeReport, AHandlerIsHeldAgainstItsPromise) {
    EXPECT_EQ(said_of(2ms),
              "Handlers of io 33: 812 edges, begun 20 us after it (50 %), 60 us (99.9 %), 70 us at worst; "
              "done 2 ms after it at worst. R is 2 ms: kept. ");
    EXPECT_THAT(said_of(10ms),
                HasSubstr("R is 2 ms, and it may wait 8 ms for its budget before that: kept."));
    EXPECT_THAT(said_of(10'001us), HasSubstr("before that: NOT kept. More came than its budget serves"));
}

TEST(GuaranteeReport, WithoutAPromiseNothingIsSaidToBeKept) {
    board::GuaranteeReport report = report_of(1ms);
    report.bottom_halves[0].response = report.bottom_halves[0].replenishment = Nanoseconds{-1};
    report.bottom_halves[0].untimed = 3;
    const std::string said = in_one_line(handlers_kept(report));
    EXPECT_THAT(said, HasSubstr("815 edges"));
    EXPECT_THAT(said, HasSubstr("Nothing was promised. Of 3 nobody knows when they came."));
    EXPECT_THAT(said, Not(HasSubstr("kept")));
    const auto json = nlohmann::json::parse(guarantee_json(report))["bottom_halves"][0];
    EXPECT_TRUE(json["response_us"].is_null());
    EXPECT_EQ(json["untimed"], 3);
    EXPECT_EQ(json["begin_worst_us"], 70);
}

TEST(GuaranteeReport, WithoutHandlersThereIsNoLine) {
    EXPECT_EQ(handlers_kept({}), "");
    EXPECT_EQ(nlohmann::json::parse(guarantee_json({}))["bottom_halves"].size(), 0u);
}

TEST(GuaranteeReport, KernelThreadsAreNamedBesideTheLoopsThatKeptTheirBudgets) {
    board::GuaranteeReport report;
    board::LoopGuarantee io;
    io.id = 34;
    io.budget = 1ms;
    io.period = 100ms;
    io.used = Nanoseconds{0};
    io.watched = 1s;
    io.kernel_threads = 2;
    io.kernel_used = 12ms;
    io.kernel_held = 31;
    report.loops.push_back(io);
    const std::string said = in_one_line(budgets_kept(report));
    EXPECT_THAT(said, HasSubstr("Budgets: every one was kept (1 loop)."));
    EXPECT_THAT(said,
                HasSubstr("Bottom halves of io 34, with 2 kernel threads: 1.2 % of its core was charged to "
                          "its budget of 1.0 %; their rank was taken 31 times."));
    const auto json = nlohmann::json::parse(guarantee_json(report))["loops"][0];
    EXPECT_EQ(json["kernel_cpu_us"], 12'000);
    report.loops[0].kernel_used = Nanoseconds{-1};
    EXPECT_THAT(budgets_kept(report), Not(HasSubstr("kernel thread")));
    EXPECT_TRUE(nlohmann::json::parse(guarantee_json(report))["loops"][0]["kernel_cpu_us"].is_null());
}

}  // namespace
}  // namespace qduino::apps::guarantee_report_test
