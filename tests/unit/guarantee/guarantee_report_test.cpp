// What the guarantee report says of bottom halves: their promise and what became of it, and the
// kernel's threads on their budget.
#include "report/guarantee_report.h"

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
    io.budget_enforced = true;
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

// ---- when "kept" may be said
// ----------------------------------------------------------------------

board::GuaranteeReport of_two_loops() {
    board::GuaranteeReport report;
    for (const board::VcpuId id : {1, 2}) {
        board::LoopGuarantee loop;
        loop.id = id;
        loop.budget = 1ms;
        loop.period = 10ms;
        loop.budget_enforced = true;
        loop.used = 300ms;
        loop.watched = 5s;
        loop.releases = 500;
        report.loops.push_back(loop);
    }
    report.ran = 5s;
    return report;
}

std::string kept_in(const board::GuaranteeReport& report) { return in_one_line(budgets_kept(report)); }

TEST(GuaranteeReport, KeptIsSaidOfLoopsThatRanAndWereWatched) {
    EXPECT_THAT(kept_in(of_two_loops()), HasSubstr("Budgets: every one was kept (2 loops)."));
}

TEST(GuaranteeReport, ALoopThatNeverRanKeptNothing) {
    board::GuaranteeReport report = of_two_loops();
    report.loops[1].releases = 0;
    EXPECT_THAT(kept_in(report), HasSubstr("Budget of loop 2: never used, for the loop never ran."));
    EXPECT_THAT(kept_in(report), HasSubstr("Budgets: the others were kept (1 loop)."));
    report.loops[0].releases = 0;
    EXPECT_THAT(kept_in(report), Not(HasSubstr("kept")));
}

TEST(GuaranteeReport, WithoutAWardenAllAlongNobodyKnowsThatTheyWereKept) {
    board::GuaranteeReport report = of_two_loops();
    report.watch_lost = "the warden died 4.9 s ago: it was killed";
    EXPECT_THAT(kept_in(report), HasSubstr("Budgets: NOT watched all along: the warden died 4.9 s ago"));
    EXPECT_THAT(kept_in(report), Not(HasSubstr("kept")));
    EXPECT_EQ(nlohmann::json::parse(guarantee_json(report))["watch_lost"],
              "the warden died 4.9 s ago: it was killed");
}

TEST(GuaranteeReport, TheTextSaysNothingOfABudgetThatTheJsonDenies) {
    board::GuaranteeReport report = of_two_loops();
    report.loops[0].budget_enforced = false;
    report.loops[0].shortfall = "nobody outside of the loop keeps its budget";
    EXPECT_THAT(kept_in(report),
                HasSubstr("Budget of loop 1 NOT ENFORCED: nobody outside of the loop keeps"));
    EXPECT_THAT(kept_in(report), HasSubstr("Budgets: the others were kept (1 loop)."));
}

TEST(GuaranteeReport, ALoopThatCouldNotHelpItIsNotAccused) {
    board::GuaranteeReport report = of_two_loops();
    report.loops[0].taken =
        "the host or interrupts ran on it for 400 ms; it was stopped from outside 3 times for that";
    EXPECT_THAT(kept_in(report), HasSubstr("Budget of loop 1: the host or interrupts ran on it for 400 ms"));
    EXPECT_THAT(kept_in(report), Not(HasSubstr("NOT KEPT")));
}

TEST(GuaranteeReport, WhoRanInFrontOfLoopsIsNamed) {
    board::GuaranteeReport report = of_two_loops();
    report.intruders = "the thread 'usurper' of the sketch made itself real-time, and was stopped";
    EXPECT_THAT(kept_in(report),
                HasSubstr("In front of loops: the thread 'usurper' of the sketch made itself"));
    EXPECT_EQ(nlohmann::json::parse(guarantee_json(report))["intruders"], report.intruders.view());
}

TEST(GuaranteeReport, PeriodsAreThereWhereTheRuntimeKnowsThem) {
    board::GuaranteeReport report;
    report.loops.push_back({});
    const auto loop = [&] { return nlohmann::json::parse(guarantee_json(report))["loops"][0]; };
    for (const char* member : {"releases", "overruns", "dropped", "missed", "worst_late_us"})
        EXPECT_TRUE(loop()[member].is_null()) << member;
    report.loops[0].releases = 70;
    report.loops[0].overruns = 2;
    report.loops[0].dropped = 1;
    report.loops[0].missed = 3;
    report.loops[0].worst_late = 1500us;
    EXPECT_EQ(loop()["releases"], 70);
    EXPECT_EQ(loop()["overruns"], 2);
    EXPECT_EQ(loop()["dropped"], 1);
    EXPECT_EQ(loop()["missed"], 3);
    EXPECT_EQ(loop()["worst_late_us"], 1500);
}

TEST(GuaranteeReport, ANameThatIsNoUtf8IsStillWritten) {
    board::GuaranteeReport report;
    report.trees.push_back({.name = "a\xff\xc3"});
    const auto json = nlohmann::json::parse(guarantee_json(report));
    EXPECT_EQ(json["trees"][0]["name"], "a\uFFFD\uFFFD");
}

TEST(GuaranteeReport, AChainHasItsBoundsAndTheWorstThatWasSeen) {
    board::GuaranteeReport report;
    report.chains.push_back({.name = "heating",
                             .way = "thermistors > loop 3 > heaters",
                             .reaction_bound = 15600us,
                             .reaction_limit = 16ms,
                             .age_bound = 7600us,
                             .reactions = 12,
                             .worst_reaction = 8500us,
                             .worst_age = 800us});
    board::ChainGuarantee other;
    other.name = "stopping";
    other.reaction_bound = 32ms;
    other.from_first_loop = true;
    report.chains.push_back(other);
    const auto chains = nlohmann::json::parse(guarantee_json(report))["chains"];
    const auto expected = nlohmann::json::parse(R"([
        {"name": "heating", "way": "thermistors > loop 3 > heaters", "reaction_bound_us": 15600.0,
         "reaction_limit_us": 16000.0, "age_bound_us": 7600.0, "age_limit_us": null, "reactions": 12,
         "worst_reaction_us": 8500.0, "worst_age_us": 800.0, "from_first_loop": false},
        {"name": "stopping", "way": "", "reaction_bound_us": 32000.0, "reaction_limit_us": null,
         "age_bound_us": null, "age_limit_us": null, "reactions": 0, "worst_reaction_us": null,
         "worst_age_us": null, "from_first_loop": true}])");
    EXPECT_EQ(chains, expected);
}

// ---- who took the core of a loop that was late --------------------------------------------------

board::GuaranteeReport late_by(Nanoseconds worst, bool owns_core = true) {
    board::GuaranteeReport report;
    board::DelayGuarantee delay;
    delay.id = 2;
    delay.core = 1;
    delay.owns_core = owns_core;
    delay.worst = worst;
    delay.at = 412s;
    delay.window = 1s;
    delay.host = Nanoseconds{0};
    delay.tasks = Nanoseconds{0};
    delay.interrupts = 283;
    delay.most = "LOC";
    report.delays.push_back(delay);
    return report;
}

std::string explained(const board::GuaranteeReport& report) { return in_one_line(delays_explained(report)); }

TEST(GuaranteeReport, ADelayIsTheHostsWhereTheHostHadTheCoreForHalfOfIt) {
    board::GuaranteeReport report = late_by(49ms);
    report.delays[0].host = 50ms;
    EXPECT_EQ(explained(report),
              "Loop 2 was late by 49 ms at worst, 412 s after it began: the host took its core. In the 1 s "
              "before that, on core 1, others ran for 0 ns, the host for 50 ms, and 283 interrupts came "
              "(most: LOC). ");
    report.delays[0].host = 20ms;
    EXPECT_THAT(explained(report), HasSubstr("an interrupt, or the host without saying so."));
}

TEST(GuaranteeReport, ADelayIsOtherTasksWhereTheyHadTheCoreForHalfOfIt) {
    board::GuaranteeReport report = late_by(49ms);
    report.delays[0].tasks = 25ms;
    report.delays[0].host = 50ms;
    EXPECT_THAT(explained(report), HasSubstr("other tasks took its core."));
}

TEST(GuaranteeReport, ADelayOfALoopThatKeepsABudgetHasANameOfItsOwn) {
    board::GuaranteeReport report = late_by(272ms, false);
    report.delays[0].throttled = 0;
    EXPECT_THAT(explained(report), HasSubstr("it slept or waited within its release, or was interrupted."));
    report.delays[0].throttled = 3;
    EXPECT_THAT(explained(report), HasSubstr("it had spent its budget, and waited for the next."));
    report.delays[0].beyond = 14ms;
    EXPECT_THAT(explained(report),
                HasSubstr("the host or an interrupt ran on its budget, and it waited for the next."));
    EXPECT_THAT(explained(report), HasSubstr("; 14 ms of it on the budget of the loop."));
    report.delays[0].interrupted = 140ms;
    EXPECT_THAT(explained(report), HasSubstr("interrupts took its core."));
    EXPECT_EQ(nlohmann::json::parse(guarantee_json(report))["delays"][0]["cause"], "interrupts");
}

TEST(GuaranteeReport, EachLateReleaseIsCountedUnderItsCause) {
    board::GuaranteeReport report = late_by(49ms, false);
    EXPECT_THAT(explained(report), Not(HasSubstr("Late in all")));
    report.delays[0].late[static_cast<std::size_t>(board::DelayCause::host)] = 7;
    report.delays[0].late[static_cast<std::size_t>(board::DelayCause::work)] = 5;
    EXPECT_THAT(explained(report),
                HasSubstr("Late in all: 12 releases, by cause: 7 (the host), 5 (its own work)."));
    const auto json = nlohmann::json::parse(guarantee_json(report))["delays"][0];
    EXPECT_EQ(json["late_host"], 7);
    EXPECT_EQ(json["late_work"], 5);
    EXPECT_EQ(json["late_tasks"], 0);
}

TEST(GuaranteeReport, AShortDelayOfAnOwnerMayBeAnyInterrupt) {
    EXPECT_THAT(explained(late_by(9us)), HasSubstr("it was an interrupt, or the host."));
    EXPECT_THAT(explained(late_by(9us, false)), HasSubstr("its own work, or it waited for its budget."));
}

TEST(GuaranteeReport, WhatNobodyTellsIsNotSaid) {
    board::GuaranteeReport report = late_by(49ms);
    report.delays[0].host = report.delays[0].tasks = Nanoseconds{-1};
    report.delays[0].interrupts = -1;
    EXPECT_THAT(explained(report), HasSubstr("In the 1 s before that, on core 1."));
    const auto json = nlohmann::json::parse(guarantee_json(report))["delays"][0];
    EXPECT_TRUE(json["host_us"].is_null());
    EXPECT_TRUE(json["interrupts"].is_null());
    EXPECT_EQ(json["worst_us"], 49'000);
    EXPECT_EQ(delays_explained({}), "");
}

TEST(GuaranteeReport, MoreInterruptsThanAdmissionCountsAreSaid) {
    board::GuaranteeReport report;
    board::CoreGuarantee core;
    core.without_alarms_per_second = core.counted_per_second = 1000;
    core.interrupts_per_second = 5000;
    report.cores.push_back(core);
    EXPECT_EQ(delays_explained(report), "");
    report.cores[0].without_alarms_per_second = 1001;
    EXPECT_THAT(explained(report), HasSubstr("Core 0 had 1001 interrupts/s beside the alarms"));
}

}  // namespace
}  // namespace qduino::apps::guarantee_report_test
