// A bottom half's budget kept from outside: when its priority is taken, and when it has it again.
// 1 ms in 10 ms, for a client of 10 ms, looked at every 4 ms.
#include "sched/io_watch.h"

#include <gtest/gtest.h>

#include "tests/unit/sched/make.h"

namespace qduino::sched::io_watch_test {
namespace {

using Verdict = IoWatch::Verdict;

constexpr Instant at(Nanoseconds since) { return kEpoch + since; }

IoWatch make_watch(Nanoseconds client_period = 10ms) { return {{1ms, 10ms}, client_period, 4ms, kEpoch, 5s}; }

TEST(IoWatch, LetsABudgetPassAndTakesThePriorityForWhatIsMore) {
    IoWatch watch = make_watch();
    EXPECT_EQ(watch.next_look(), at(4ms));
    EXPECT_EQ(watch.look(at(4ms), 5s + 900us), Verdict::run);
    EXPECT_EQ(watch.look(at(8ms), 5s + 2ms), Verdict::hold);
    EXPECT_EQ(watch.holds(), 1u);
    EXPECT_EQ(watch.used(), 2ms);
    EXPECT_EQ(watch.next_look(), at(3100us + 20ms)) << "2 ms at a tenth, from when it began to run";
    EXPECT_EQ(watch.look(watch.next_look(), 5s + 2ms), Verdict::run);
    EXPECT_EQ(watch.holds(), 1u);
}

TEST(IoWatch, ChargesWhatItUsedBeforeItWasHeldAndNothingAfterwards) {
    IoWatch watch = make_watch();
    EXPECT_EQ(watch.look(at(4ms), 5s + 4ms), Verdict::hold);
    watch.held(at(5ms), 5s + 5ms);
    EXPECT_EQ(watch.used(), 5ms);
    EXPECT_EQ(watch.next_look(), at(50ms));
    EXPECT_EQ(watch.look(at(30ms), 5s + 20ms), Verdict::hold);
    EXPECT_EQ(watch.look(at(50ms), 5s + 40ms), Verdict::run);
    EXPECT_EQ(watch.used(), 5ms) << "the rest was nobody's time";
    EXPECT_EQ(watch.watched(), 50ms);
}

TEST(IoWatch, NeverTakesThePriorityOfOneThatHasItsShare) {
    IoWatch watch = make_watch();
    Nanoseconds cpu = 5s;
    for (Instant now = at(4ms); now < at(2s); now += 4ms)
        EXPECT_EQ(watch.look(now, cpu += 300us), Verdict::run) << to_ns(now);
    EXPECT_EQ(watch.holds(), 0u);
}

TEST(IoWatch, AnIdleLookEndsItsServiceAndCostsItNothing) {
    IoWatch watch = make_watch();
    EXPECT_EQ(watch.look(at(4ms), 5s + 500us), Verdict::run);
    EXPECT_EQ(watch.look(at(8ms), 5s + 500us), Verdict::run);
    EXPECT_EQ(watch.look(at(12ms), 5s + 1400us), Verdict::run) << "a whole budget again";
}

TEST(IoWatch, HasTheBudgetOfItsClientsPeriod) {
    IoWatch watch = make_watch(100ms);
    EXPECT_EQ(watch.look(at(4ms), 5s + 4ms), Verdict::run);
    EXPECT_EQ(watch.look(at(8ms), 5s + 8ms), Verdict::run);
    EXPECT_EQ(watch.look(at(12ms), 5s + 12ms), Verdict::hold) << "10 ms of 100";
}

TEST(IoWatch, TakesUpAnotherBudget) {
    IoWatch watch = make_watch();
    watch.change(at(4ms), 5s, {5ms, 10ms});
    EXPECT_EQ(watch.look(at(8ms), 5s + 4ms), Verdict::run);
    watch.change(at(8ms), 5s + 4ms, {1ms, 10ms});
    EXPECT_EQ(watch.look(at(16ms), 5s + 6ms), Verdict::hold);
}

}  // namespace
}  // namespace qduino::sched::io_watch_test
