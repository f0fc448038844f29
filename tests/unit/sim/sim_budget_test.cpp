// Budgets in the simulator, exact to the nanosecond: bursts, totals, and what one loop can do to
// another.
#include <gtest/gtest.h>

#include "sim_fixture.h"

namespace qduino::board::sim::testing::sim_budget_test {
namespace {

using Burst = KeptTrace::Burst;

class SimBudget : public ::testing::Test {
  protected:
    SimBoard& board(SimConfig config = {}) {
        board_ = std::make_unique<SimBoard>(std::move(config), wires_, &trace_);
        return *board_;
    }
    Program::Body busy_for_ever(SimBoard& b) {
        return [&b] { b.busy_until(kForever); };
    }

    NoPeripherals wires_;
    KeptTrace trace_;
    Program program_;
    std::unique_ptr<SimBoard> board_;
};

TEST_F(SimBudget, ABusyLoopRunsItsBudgetInEveryPeriodToTheNanosecond) {
    SimBoard& b = board();
    program_.loop(1, 30ms, 100ms, 0, busy_for_ever(b));
    ASSERT_TRUE(b.start(program_.specs()));
    b.run(at(10s));
    const std::vector<Burst> bursts = trace_.bursts(1);
    ASSERT_EQ(bursts.size(), 100u);
    for (std::size_t k = 0; k < bursts.size(); ++k) {
        const Instant begin = at(100ms * static_cast<std::int64_t>(k));
        EXPECT_EQ(bursts[k], (Burst{begin, begin + 30ms})) << "burst " << k;
    }
    EXPECT_EQ(b.cpu_time(1), Nanoseconds{3s});
    EXPECT_EQ(b.now(), at(10s));
}

TEST_F(SimBudget, TheHigherPriorityTakesItsBudgetOutOfTheMiddle) {
    SimBoard& b = board();
    program_.loop(1, 30ms, 100ms, 0, busy_for_ever(b)).loop(2, 5ms, 50ms, 0, busy_for_ever(b));
    ASSERT_TRUE(b.start(program_.specs()));
    b.run(at(200ms));
    EXPECT_EQ(trace_.bursts(2),
              (std::vector<Burst>{
                  {at(0ms), at(5ms)}, {at(50ms), at(55ms)}, {at(100ms), at(105ms)}, {at(150ms), at(155ms)}}));
    // Loop 1 is held up for 5 ms in its first period; its budget became active at 5 ms, and comes
    // back 100 ms later.
    EXPECT_EQ(trace_.bursts(1), (std::vector<Burst>{{at(5ms), at(35ms)}, {at(105ms), at(135ms)}}));
}

TEST_F(SimBudget, ALoopPastItsBudgetIsStoppedAtTheInstantAndGoesOnAfterReplenishment) {
    SimBoard& b = board();
    std::vector<Instant> passed;
    program_.loop(1, 30ms, 100ms, 0, [&] {
        b.compute(70ms);
        passed.push_back(b.now());
        b.busy_until(b.now() + 5ms);
        passed.push_back(b.now());
    });
    ASSERT_TRUE(b.start(program_.specs()));
    b.run(at(1s));
    // 30 + 30 + 10 ms of work: the last 10 in the third period; then 5 ms that are spun within it.
    EXPECT_EQ(passed, (std::vector<Instant>{at(210ms), at(215ms)}));
    EXPECT_EQ(trace_.bursts(1),
              (std::vector<Burst>{{at(0ms), at(30ms)}, {at(100ms), at(130ms)}, {at(200ms), at(215ms)}}));
    EXPECT_TRUE(b.stopped());
}

TEST_F(SimBudget, ASpinEndsOnTimeOrWhenTheLoopRunsAgain) {
    SimBoard& b = board();
    std::vector<Instant> passed;
    program_.loop(1, 30ms, 100ms, 0, [&] {
        b.busy_until(at(20ms));
        passed.push_back(b.now());
        b.busy_until(at(60ms));  // its budget ends at 30 ms; at 60 ms it is throttled
        passed.push_back(b.now());
        b.busy_until(at(70ms));  // long past
        passed.push_back(b.now());
    });
    ASSERT_TRUE(b.start(program_.specs()));
    b.run(at(1s));
    EXPECT_EQ(passed, (std::vector<Instant>{at(20ms), at(100ms), at(100ms)}));
}

TEST_F(SimBudget, ARunawayTakesNothingFromTheOtherFor60Seconds) {
    for (const bool runaway_is_above : {false, true}) {
        SimBoard& b = board();
        Program program;
        std::uint64_t releases = 0;
        Instant expected = at(0s);
        const Nanoseconds runaway_period = runaway_is_above ? Nanoseconds{4ms} : Nanoseconds{100ms};
        program.loop(1, runaway_period * 3 / 10, runaway_period, 0, busy_for_ever(b));
        program.loop(2, 2ms, 8ms, 0, periodic_work(b, 2ms, 8ms, [&](Instant release, Instant end) {
                         EXPECT_EQ(release, expected);
                         EXPECT_LE(end, release + 8ms);
                         expected += 8ms;
                         ++releases;
                     }));
        ASSERT_TRUE(b.start(program.specs()));
        b.run(at(60s));
        EXPECT_EQ(releases, 7500u);
        EXPECT_EQ(b.cpu_time(2), Nanoseconds{15s});
        EXPECT_EQ(b.cpu_time(1), Nanoseconds{18s});
    }
}

TEST_F(SimBudget, CoresAreIndependent) {
    SimBoard& b = board({.cores = 3});
    program_.loop(1, 30ms, 100ms, 0, busy_for_ever(b))
        .loop(2, 50ms, 100ms, 1, busy_for_ever(b))
        .owning_loop(3, 100us, 2, busy_for_ever(b));
    ASSERT_TRUE(b.start(program_.specs()));
    b.run(at(1s));
    EXPECT_EQ(b.cpu_time(1), Nanoseconds{300ms});
    EXPECT_EQ(b.cpu_time(2), Nanoseconds{500ms});
    EXPECT_EQ(trace_.bursts(3).size(), 0u);  // its one burst has not ended
    EXPECT_EQ(trace_.count(TraceKind::throttle, 3), 0u);
}

TEST_F(SimBudget, AnOwningLoopIsNeverThrottled) {
    SimBoard& b = board();
    std::vector<Instant> passed;
    program_.loop(1, 30ms, 100ms, 0, busy_for_ever(b)).owning_loop(2, 100us, 1, [&] {
        for (int i = 1; i <= 10'000; ++i) {
            b.busy_until(at(100us * i));
            ASSERT_EQ(b.now(), at(100us * i));
        }
        passed.push_back(b.now());
    });
    ASSERT_TRUE(b.start(program_.specs()));
    b.run(at(2s));
    EXPECT_EQ(passed, (std::vector<Instant>{at(1s)}));
}

}  // namespace
}  // namespace qduino::board::sim::testing::sim_budget_test
