// Execution times to the nanosecond in the simulator, and the budgets that follow from them.
#include "report/profile_report.h"

#include <gmock/gmock.h>

#include <array>
#include <functional>
#include <nlohmann/json.hpp>
#include <random>
#include <utility>
#include <vector>

#include "board/sim/sim_board.h"
#include "report/sketch_report.h"

namespace qduino::apps::profile_report_test {
namespace {

using board::sim::SimBoard;
using board::sim::SimConfig;
using runtime::Execution;
using runtime::Loop;
using runtime::Runtime;
using ::testing::HasSubstr;

/// Up to three loops whose bodies are lambdas.
class ProfileTest : public ::testing::Test {
  protected:
    void SetUp() override { test = this; }
    void loop(board::VcpuId id, Nanoseconds budget, Nanoseconds period, int core,
              std::function<void(int release)> body) {
        constexpr std::array<void (*)(), 4> kBodies{nullptr, &call<1>, &call<2>, &call<3>};
        bodies_[id] = std::move(body);
        table_.loops.push_back({{id, budget, period, core}, kBodies.at(id), "a.ino", id});
    }
    void run(Nanoseconds length) {
        runtime_ = std::make_unique<Runtime>(board_, runtime::RuntimeOptions{.profile = true});
        table_.setup = &call_setup;
        ASSERT_TRUE(runtime_->begin(table_));
        runtime_->run(kEpoch + length);
        board_.request_stop();
        runtime_->run(kEpoch + length + 1s);
    }
    const Loop& profiled(board::VcpuId id) { return *runtime_->loop(id); }
    void work(Nanoseconds amount) { board_.compute(amount); }
    static void wait() { test->runtime_->wait_for_next_period(); }
    [[nodiscard]] ProfiledRun facts() { return {.sketch = "a", .margin = 0.2, .end = board_.now()}; }

    template <int Id>
    static void call() {
        test->bodies_[Id](++test->releases_[Id]);
    }
    static void burn() { test->work(40us); }
    static void call_setup() {
        if (test->setup_) test->setup_();
    }

    static inline ProfileTest* test = nullptr;
    board::NoPeripherals wires_;
    SimBoard board_{SimConfig{}, wires_};
    runtime::SketchTable table_;
    std::array<std::function<void(int)>, 4> bodies_;
    std::array<int, 4> releases_{};
    std::function<void()> setup_;
    std::unique_ptr<Runtime> runtime_;
};

TEST_F(ProfileTest, MeasuresWhatALoopComputesAndNotWhatOthersTake) {
    loop(1, 2ms, 10ms, 0, [&](int) { work(1ms), wait(); });
    loop(2, 40ms, 100ms, 0, [&](int release) { work(release == 3 ? 21ms : 20ms), wait(); });
    run(1s);
    const runtime::ExecutionProfile& slow = *profiled(2).profile;
    EXPECT_EQ(slow.cpu_ns().min(), 20'000'000u);
    EXPECT_EQ(slow.cpu_ns().max(), 21'000'000u) << "the milliseconds of loop 1 in between are not in it";
    EXPECT_EQ(slow.length_ns().max(), 23'000'000u) << "and are in its length";
    EXPECT_EQ(slow.worst()[0].number, 3);
    EXPECT_EQ(slow.worst()[0].cpu, Nanoseconds{21ms});
    EXPECT_EQ(slow.worst()[1].cpu, Nanoseconds{20ms});
    EXPECT_EQ(slow.worst()[0].began, kEpoch + 201ms);
    EXPECT_EQ(profiled(1).profile->cpu_ns().max(), 1'000'000u);
}

TEST_F(ProfileTest, ASleepInsideARelaseCostsNothingAndALoopThatNeverWaitsIsMeasuredByPasses) {
    loop(1, 2ms, 10ms, 0, [&](int) { work(1ms), board_.sleep_until(board_.now() + 3ms), work(1ms), wait(); });
    loop(2, 1ms, 10ms, 1, [&](int) { work(300us), board_.sleep_until(board_.now() + 5ms); });
    run(1s);
    EXPECT_EQ(profiled(1).profile->cpu_ns().max(), 2'000'000u);
    EXPECT_EQ(profiled(1).profile->length_ns().max(), 5'000'000u);
    EXPECT_EQ(profiled(2).profile->cpu_ns().max(), 300'000u);
    EXPECT_THAT(suggestion_for(profiled(2), 0.2).why_not, HasSubstr("waits for no period"));
}

TEST_F(ProfileTest, WithoutBeingAskedForThereIsNone) {
    loop(1, 2ms, 10ms, 0, [&](int) { wait(); });
    runtime_ = std::make_unique<Runtime>(board_);
    ASSERT_TRUE(runtime_->begin(table_));
    runtime_->run(kEpoch + 100ms);
    EXPECT_EQ(profiled(1).profile, nullptr);
}

TEST_F(ProfileTest, AHandlerIsMeasuredRunByRun) {
    setup_ = [&] {
        ASSERT_TRUE(runtime_->attach_interrupt({7}, board::Edge::rising, &burn, 1ms, 10ms, 1));
        ASSERT_TRUE(board_.pin_mode({7}, board::PinMode::output));
    };
    loop(1, 2ms, 10ms, 0, [&](int release) {
        board_.pin_write({7}, release % 2 == 1 ? board::Level::high : board::Level::low);
        wait();
    });
    run(1s);
    const runtime::ExecutionProfile* handler = runtime_->handler_profile({7});
    ASSERT_NE(handler, nullptr);
    EXPECT_EQ(handler->cpu_ns().max(), 40'000u);
    EXPECT_EQ(handler->least_gap(), Nanoseconds{20ms});
    EXPECT_EQ(handler->busiest(), Nanoseconds{40us});
    EXPECT_THAT(profile_text(*runtime_, facts()), HasSubstr("C 1 ms -> 100 us"));
    EXPECT_THAT(profile_text(*runtime_, facts()), HasSubstr("busiest 40 us in one T; gaps from 20 ms"));
}

TEST_F(ProfileTest, AHandlersBudgetIsThatOfItsBusiestPeriod) {
    setup_ = [&] {
        ASSERT_TRUE(runtime_->attach_interrupt({7}, board::Edge::rising, &burn, 1ms, 10ms, 1));
        ASSERT_TRUE(board_.pin_mode({7}, board::PinMode::output));
    };
    // Bursts of three edges, 1 ms apart, every 100 ms.
    loop(1, 500us, 1ms, 0, [&](int release) {
        board_.pin_write({7}, board::Level::low);
        if (release % 100 < 3) board_.pin_write({7}, board::Level::high);
        wait();
    });
    run(2s);
    const Suggestion suggestion = suggestion_for(*runtime_, {7}, 0.2);
    EXPECT_EQ(suggestion.why_not, "");
    EXPECT_EQ(runtime_->handler_profile({7})->busiest(), Nanoseconds{120us});
    EXPECT_EQ(suggestion.budget, Nanoseconds{150us}) << "144 us, to two digits";
    EXPECT_EQ(suggestion.period, Nanoseconds{10ms});
}

TEST_F(ProfileTest, AHandlerWithoutAVcpuOfItsOwnGetsNoSuggestion) {
    setup_ = [&] {
        ASSERT_TRUE(runtime_->attach_interrupt({7}, board::Edge::rising, &burn, {}, {}, 1));
        ASSERT_TRUE(board_.pin_mode({7}, board::PinMode::output));
    };
    loop(1, 2ms, 10ms, 0, [&](int release) {
        board_.pin_write({7}, release % 2 == 1 ? board::Level::high : board::Level::low);
        wait();
    });
    run(1s);
    EXPECT_THAT(suggestion_for(*runtime_, {7}, 0.2).why_not, HasSubstr("interruptsVcpu"));
}

TEST(BusiestWindow, IsTheMostThatAnyWindowHasAsASlowSumFindsIt) {
    std::mt19937 random{5};
    for (int round = 0; round < 200; ++round) {
        const Nanoseconds length{1 + static_cast<std::int64_t>(random() % 1000)};
        runtime::BusiestWindow busiest{length};
        std::vector<std::pair<Instant, Nanoseconds>> runs;
        Instant now = kEpoch;
        for (int i = 0; i < 300; ++i) {
            now += Nanoseconds{static_cast<std::int64_t>(random() % (round % 2 == 0 ? 200 : 20))};
            runs.emplace_back(now, Nanoseconds{static_cast<std::int64_t>(random() % 50)});
            busiest.add(now, runs.back().second);
        }
        Nanoseconds most{};
        std::size_t in_one = 0;
        for (const auto& last : runs) {
            Nanoseconds sum{};
            std::size_t count = 0;
            for (const auto& [began, cpu] : runs) {
                if (began <= last.first && began + length > last.first) sum += cpu, ++count;
            }
            most = std::max(most, sum);
            in_one = std::max(in_one, count);
        }
        EXPECT_GE(busiest.most(), most) << round;
        if (in_one <= runtime::BusiestWindow::kRunsKept) {
            EXPECT_EQ(busiest.most(), most) << round;
        }
    }
}

TEST(RoundedUp, HasTwoDigitsAndIsNeverLess) {
    EXPECT_EQ(rounded_up(161'200ns), Nanoseconds{170us});
    EXPECT_EQ(rounded_up(160us), Nanoseconds{160us});
    EXPECT_EQ(rounded_up(99ns), Nanoseconds{99ns});
    EXPECT_EQ(rounded_up(100ns), Nanoseconds{100ns});
    EXPECT_EQ(rounded_up(101ns), Nanoseconds{110ns});
    EXPECT_EQ(rounded_up(996us), Nanoseconds{1ms});
    for (std::int64_t ns = 1; ns < 2'000'000'000; ns = ns * 17 / 16 + 1) {
        EXPECT_GE(rounded_up(Nanoseconds{ns}).count(), ns);
        EXPECT_LE(rounded_up(Nanoseconds{ns}).count(), ns + ns / 9) << ns;
    }
}

TEST_F(ProfileTest, TheSuggestionIsTheWorstAndTheMarginAndAHundredMicrosecondsAtLeast) {
    loop(1, 2ms, 10ms, 0, [&](int release) { work(release == 5 ? 500us : 100us), wait(); });
    loop(2, 2ms, 10ms, 1, [&](int) { work(10us), wait(); });
    run(1s);
    EXPECT_EQ(suggestion_for(profiled(1), 0.2).budget, Nanoseconds{600us});
    EXPECT_EQ(suggestion_for(profiled(1), 0.5).budget, Nanoseconds{750us});
    EXPECT_EQ(suggestion_for(profiled(1), 0.2).period, Nanoseconds{10ms});
    EXPECT_EQ(suggestion_for(profiled(2), 0.2).budget, Nanoseconds{100us});
}

TEST_F(ProfileTest, ThePeriodGrowsWhereTheReleasesDoNotFitIt) {
    loop(1, 2ms, 10ms, 0, [&](int) { work(1ms), board_.sleep_until(board_.now() + 14ms), wait(); });
    run(2s);
    EXPECT_EQ(suggestion_for(profiled(1), 0.2).budget, Nanoseconds{1200us});
    EXPECT_GE(suggestion_for(profiled(1), 0.2).period, Nanoseconds{18ms});
    EXPECT_THAT(profile_text(*runtime_, facts()), HasSubstr("T 10 ms -> "));
}

TEST_F(ProfileTest, ABudgetThatWasTooShortSaysNothingOfThePeriod) {
    // 4 ms of work in a budget of 1 ms in 10: it is cut three times, and takes 31 ms.
    loop(1, 1ms, 10ms, 0, [&](int) { work(4ms), wait(); });
    run(2s);
    EXPECT_EQ(profiled(1).profile->cpu_ns().max(), 4'000'000u);
    EXPECT_EQ(suggestion_for(profiled(1), 0.2).budget, Nanoseconds{4800us});
    EXPECT_EQ(suggestion_for(profiled(1), 0.2).period, Nanoseconds{10ms});
}

TEST_F(ProfileTest, ALoopThatOwnsItsCoreAndOneWithFewReleasesGetNone) {
    loop(1, 1ms, 1ms, 1, [&](int) { work(1us), wait(); });
    loop(2, 10ms, 100ms, 0, [&](int) { work(1ms), wait(); });
    run(1s);
    EXPECT_EQ(suggestion_for(profiled(1), 0.2).why_not, "owns its core");
    EXPECT_EQ(suggestion_for(profiled(2), 0.2).why_not, "too few: run longer");
}

TEST_F(ProfileTest, TheReportsSayItAndWhetherItWouldBeAdmitted) {
    loop(1, 2ms, 10ms, 0, [&](int release) { work(release == 5 ? 500us : 100us), wait(); });
    run(1s);
    const std::string text = profile_text(*runtime_, facts());
    EXPECT_THAT(text, HasSubstr("C 2 ms -> 600 us"));
    EXPECT_THAT(text, HasSubstr("500 us in release 5 at 0.040 s"));
    EXPECT_THAT(text, HasSubstr("With these: admitted"));
    std::size_t longest = 0;
    for (std::size_t at = 0, end = 0; (end = text.find('\n', at)) != std::string::npos; at = end + 1)
        longest = std::max(longest, end - at);
    EXPECT_LE(longest, 80u);

    const auto json = nlohmann::json::parse(profile_json(*runtime_, facts()));
    EXPECT_EQ(json["simulated"], true);
    EXPECT_EQ(json["admitted"], true);
    const auto& loop = json["loops"][0];
    EXPECT_EQ(loop["worst_ns"], 500'000);
    EXPECT_EQ(loop["suggested"]["budget_ns"], 600'000);
    EXPECT_EQ(loop["worst"][0]["number"], 5);
    std::int64_t in_buckets = 0;
    for (const auto& bucket : loop["histogram"]) in_buckets += bucket[1].get<std::int64_t>();
    EXPECT_EQ(loop["count"], in_buckets);
}

TEST_F(ProfileTest, ALoopThatSitsInADelayHasNotKeptItsPeriods) {
    loop(1, 2ms, 10ms, 0, [&](int release) {
        if (release == 50) board_.sleep_until(board_.now() + 36000s);
        wait();
    });
    run(2s);
    EXPECT_EQ(
        periods_kept(loops_of(*runtime_), board_.now()),
        "NOT every period was kept (1 loop, 50 releases); loop 1 has not ended a release for 2.51 s and "
        "missed 251 periods");
}

TEST_F(ProfileTest, ALoopThatNeverEndsItsFirstReleaseHasNotKeptItsPeriods) {
    loop(1, 2ms, 10ms, 0, [&](int) { board_.sleep_until(board_.now() + 36000s); });
    run(2s);
    EXPECT_EQ(periods_kept(loops_of(*runtime_), board_.now()),
              "NOT every period was kept (1 loop, 1 release); loop 1 has not ended a release for 3 s and "
              "missed 300 periods");
    EXPECT_EQ(guarantee_of(*runtime_).loops[0].missed, 300) << "the report as JSON says the same";
}

TEST_F(ProfileTest, ALoopThatWaitsForNoPeriodEndsItsPasses) {
    loop(1, 2ms, 10ms, 0, [&](int) { work(100us); });
    run(2s);
    EXPECT_THAT(periods_kept(loops_of(*runtime_), board_.now()),
                HasSubstr("every period was kept (1 loop, 1 release)"));
    EXPECT_EQ(guarantee_of(*runtime_).loops[0].missed, 0);
}

}  // namespace
}  // namespace qduino::apps::profile_report_test
