// Locks between loops of one core, to the nanosecond: which loop waits for what, and which one
// pays.
#include <random>

#include "arduino/core/channels.h"
#include "arduino/core/releases.h"
#include "arduino/core/timing.h"
#include "tests/scenario/guarantee/sketch_bench.h"

namespace qduino::guarantee::lock_test {
namespace {

/// Three loops: 1 low, 2 mid, 3 high. Each body runs once; then the loop waits for its periods.
class LocksOfOneCore : public ::testing::Test {
  protected:
    void add_once(VcpuId id, Nanoseconds budget, Nanoseconds period, SketchBench::Body body) {
        sketch_.add_loop(id, budget, period, 0, [this, id, body = std::move(body)] {
            if (!std::exchange(begun_.at(id), true)) body();
            waitForNextPeriod();
        });
    }
    void compute(Nanoseconds amount) { sketch_.board().compute(amount); }
    static void sleep(Nanoseconds until) { delayUntil(at(until)); }

    std::array<bool, 5> begun_{};
    Mutex mutex_;
    Instant high_locked_, low_unlocked_, mid_done_;
    SketchBench sketch_;
};

TEST_F(LocksOfOneCore, HighWaitsForTheCriticalSectionOfLowAndForNothingOfMid) {
    add_once(1, 40ms, 400ms, [this] {
        mutex_.lock();
        compute(5ms);
        low_unlocked_ = timeNow();
        mutex_.unlock();
    });
    add_once(2, 50ms, 200ms, [this] {
        sleep(1ms);
        compute(50ms);
        mid_done_ = timeNow();
    });
    add_once(3, 20ms, 100ms, [this] {
        sleep(2ms);
        mutex_.lock();
        high_locked_ = timeNow();
        compute(1ms);
        mutex_.unlock();
    });
    ASSERT_TRUE(sketch_.begin());
    sketch_.run(1s);
    // low 0–1, mid 1–2, low as high 2–6, high 6–7, mid 7–56.
    EXPECT_EQ(low_unlocked_, at(6ms));
    EXPECT_EQ(high_locked_, at(6ms));
    EXPECT_EQ(mid_done_, at(56ms));
}

TEST_F(LocksOfOneCore, ARankGoesThroughAChainOfLocks) {
    Mutex second;
    add_once(1, 40ms, 400ms, [&] {
        mutex_.lock();
        compute(5ms);
        mutex_.unlock();
        compute(5ms);
    });
    add_once(2, 50ms, 200ms, [&] {  // waits for low, holding what high wants
        sleep(1ms);
        second.lock();
        mutex_.lock();
        compute(2ms);
        mutex_.unlock();
        second.unlock();
        compute(10ms);
        mid_done_ = timeNow();
    });
    add_once(3, 20ms, 100ms, [&] {
        sleep(2ms);
        second.lock();
        high_locked_ = timeNow();
        second.unlock();
    });
    add_once(4, 20ms, 150ms, [&] {  // above mid and low, below high
        sleep(3ms);
        compute(20ms);
    });
    ASSERT_TRUE(sketch_.begin({}, {.enforce_admission = false}));
    sketch_.run(1s);
    EXPECT_EQ(high_locked_, at(7ms));  // 5 of low, 2 of mid: loop 4 took nothing
    EXPECT_EQ(mid_done_, at(37ms));    // then loop 4 its 20, mid its 10
}

TEST_F(LocksOfOneCore, AWaiterHasNoBudgetToPayAndTheLockGoesToTheHighest) {
    std::vector<int> order;
    for (const VcpuId id : {VcpuId{2}, VcpuId{3}, VcpuId{4}}) {  // in order of their ranks: 4, 3, 2
        add_once(id, 10ms, Nanoseconds{500ms} - id * Nanoseconds{100ms}, [this, id, &order] {
            sleep((id - 1) * Nanoseconds{1ms});  // they come in the opposite order
            mutex_.lock();
            order.push_back(id);
            mutex_.unlock();
        });
    }
    add_once(1, 40ms, 400ms, [this] {
        mutex_.lock();
        compute(20ms);
        mutex_.unlock();
    });
    ASSERT_TRUE(sketch_.begin());
    sketch_.run(100ms);
    EXPECT_EQ(order, (std::vector<int>{4, 3, 2}));
    for (const VcpuId id : {VcpuId{2}, VcpuId{3}, VcpuId{4}})
        EXPECT_EQ(sketch_.board().cpu_time(id), Nanoseconds{0});
    EXPECT_EQ(sketch_.board().cpu_time(1), Nanoseconds{20ms});
}

TEST_F(LocksOfOneCore, AHolderWithoutBudgetGoesOnWithThatOfItsWaiter) {
    add_once(1, 3ms, 100ms, [this] {
        mutex_.lock();
        compute(5ms);  // two more than its budget
        mutex_.unlock();
        low_unlocked_ = timeNow();
        delayBusyUntil(kForever);
    });
    add_once(3, 10ms, 50ms, [this] {
        sleep(1ms);
        mutex_.lock();
        high_locked_ = timeNow();
        mutex_.unlock();
    });
    ASSERT_TRUE(sketch_.begin({}, {.enforce_admission = false}));
    sketch_.run(99ms);
    EXPECT_EQ(high_locked_, at(5ms));  // and not at 102 ms, when its next budget comes
    EXPECT_EQ(low_unlocked_, at(5ms));
    EXPECT_EQ(sketch_.board().cpu_time(1), Nanoseconds{3ms});
    EXPECT_EQ(sketch_.board().cpu_time(3), Nanoseconds{2ms});
    sketch_.run(10s);
    EXPECT_EQ(sketch_.board().cpu_time(1), Nanoseconds{300ms});
}

TEST_F(LocksOfOneCore, WhoHangsInItsCriticalSectionIsThrottledAllTheSame) {
    add_once(1, 3ms, 100ms, [this] {
        mutex_.lock();
        delayBusyUntil(kForever);
    });
    sketch_.add_loop(2, 50ms, 200ms, 0, [this] {
        compute(50ms);
        waitForNextPeriod();
    });
    ASSERT_TRUE(sketch_.begin({}, {.enforce_admission = false}));
    sketch_.run(99ms);
    EXPECT_EQ(sketch_.board().cpu_time(1), Nanoseconds{3ms});  // its budget: nobody waits
    sketch_.run(10s);
    EXPECT_EQ(sketch_.board().cpu_time(1), Nanoseconds{300ms});
    EXPECT_EQ(sketch_.statistics(2).releases.get(), 50);
    EXPECT_EQ(sketch_.statistics(2).overruns.get(), 0);
}

TEST(LocksOfTwoCores, AWaiterLendsItsRankToTheOtherCore) {
    Mutex mutex;
    Instant locked;
    SketchBench sketch;
    const auto once = [](bool& begun, auto body) {
        return [&begun, body] {
            if (!std::exchange(begun, true)) body();
            waitForNextPeriod();
        };
    };
    bool begun[4] = {};
    sketch.add_loop(1, 40ms, 400ms, 0, once(begun[1], [&] {
                        mutex.lock();
                        sketch.board().compute(5ms);
                        mutex.unlock();
                    }));
    sketch.add_loop(2, 50ms, 200ms, 0, once(begun[2], [&] {
                        delayUntil(at(1ms));
                        sketch.board().compute(50ms);
                    }));
    sketch.add_loop(3, 20ms, 100ms, 1, once(begun[3], [&] {
                        delayUntil(at(2ms));
                        mutex.lock();
                        locked = timeNow();
                        mutex.unlock();
                    }));
    sketch.set_setup([&] {
        mutex.heldBy(1, 5ms);
        mutex.heldBy(3, 1ms);
    });
    ASSERT_TRUE(sketch.begin());
    sketch.run(1s);
    EXPECT_EQ(locked, at(6ms));
    EXPECT_EQ(sketch.runtime().plan().admission().cores[1].loops[0].response, 25ms);
}

/// Each loop may wait for whole budgets of the other core, for a lock that says nothing.
TEST(LocksOfTwoCores, ALockThatSaysNothingIsRefusedWithItsCure) {
    Mutex mutex;
    SketchBench sketch;
    sketch.add_loop(1, 60ms, 200ms, 0, waitForNextPeriod);
    sketch.add_loop(2, 10ms, 50ms, 1, waitForNextPeriod);
    ASSERT_FALSE(sketch.begin());
    const std::string said{sketch.runtime().explanation().view()};
    EXPECT_NE(said.find("loop 2 waits for locks that it shares with loop 1,\n  some on other cores"),
              std::string::npos)
        << said;
}

TEST(LocksDeathTest, ACycleOfWaitsIsSaid) {
    const auto deadlock = [] {
        Mutex first, second;
        SketchBench sketch;
        sketch.add_loop(1, 10ms, 100ms, 0, [&] {
            first.lock();
            delayUntil(at(1ms));
            second.lock();
        });
        sketch.add_loop(2, 10ms, 50ms, 0, [&] {
            second.lock();
            delayUntil(at(2ms));
            first.lock();
        });
        static_cast<void>(sketch.begin());
        sketch.run(1s);
    };
    EXPECT_DEATH(deadlock(), "closes_a_cycle");
}

/// Random critical sections of three loops on one core: the highest never waits longer than the
/// longest of one other loop.
TEST(LocksProperty, TheHighestWaitsForOneCriticalSectionAtMost) {
    for (unsigned seed = 1; seed <= 10; ++seed) {
        SCOPED_TRACE(seed);
        std::mt19937 random{seed};
        const auto draw = [&random](int most_us) {
            return Nanoseconds{1000 * (1 + static_cast<int>(random() % static_cast<unsigned>(most_us)))};
        };
        Mutex mutex;
        Nanoseconds longest_section{}, longest_wait{};
        SketchBench sketch;
        for (const VcpuId id : {VcpuId{1}, VcpuId{2}}) {
            sketch.add_loop(id, id == 1 ? 20ms : 10ms, id == 1 ? 100ms : 50ms, 0, [&] {
                sketch.board().compute(draw(2000));
                mutex.lock();
                const Nanoseconds section = draw(1500);
                longest_section = std::max(longest_section, section);
                sketch.board().compute(section);
                mutex.unlock();
                sketch.board().compute(draw(2000));
                waitForNextPeriod();
            });
        }
        sketch.add_loop(3, 1ms, 10ms, 0, [&] {
            delayUntil(timeNow() + draw(7000));  // at any point of the others' work
            const Instant wanted = timeNow();
            mutex.lock();
            longest_wait = std::max(longest_wait, timeNow() - wanted);
            sketch.board().compute(100us);
            mutex.unlock();
            waitForNextPeriod();
        });
        ASSERT_TRUE(sketch.begin({}, {.enforce_admission = false}));
        sketch.run(20s);
        EXPECT_GT(longest_wait, Nanoseconds{0});
        EXPECT_LE(longest_wait, longest_section);
        EXPECT_EQ(sketch.statistics(3).overruns.get(), 0);
        EXPECT_EQ(sketch.statistics(3).releases.get(), 2000);
    }
}

}  // namespace
}  // namespace qduino::guarantee::lock_test
