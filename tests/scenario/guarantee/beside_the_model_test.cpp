// What stands beside the servers and the equation: late wake-ups, edges, interrupts that a budget
// pays for, sleeps in many pieces, locks that nobody speaks of, handlers that hold one, and who
// pays for a holder. Each is in R or refused: a loop that keeps to what it declares is never late.
#include <gtest/gtest.h>

#include "arduino/SPI.h"
#include "arduino/Wire.h"
#include "arduino/core/channels.h"
#include "arduino/core/interrupts.h"
#include "arduino/core/releases.h"
#include "arduino/core/timing.h"
#include "arduino/libraries/FreeRTOS/freertos/objects.h"
#include "tests/scenario/guarantee/sketch_bench.h"

namespace qduino::guarantee::beside_the_model_test {
namespace {

constexpr int kPin = 5;

SimConfig one_core() {
    SimConfig config;
    config.cores = 1;
    return config;
}

/// A loop that computes so long, and waits.
SketchBench::Body computing(SketchBench& sketch, Nanoseconds length) {
    return [&sketch, length] {
        sketch.board().compute(length);
        waitForNextPeriod();
    };
}

Nanoseconds response_of(SketchBench& sketch, VcpuId loop) {
    for (const sched::LoopResponse& each : sketch.runtime().plan().admission().cores[0].loops) {
        if (each.id == loop) return each.response;
    }
    return Nanoseconds{-1};
}

/// The longest that a release of `loop` took, from when it was due; nothing was late.
void expect_met(SketchBench& sketch, VcpuId loop) {
    EXPECT_EQ(sketch.statistics(loop).overruns.get(), 0) << "loop " << int{loop};
    EXPECT_GT(sketch.statistics(loop).releases.get(), 10) << "loop " << int{loop};
}

std::string words_of(const Result<void>& result) {
    return result ? "" : std::string{result.error().message.view()};
}

// ---- late wake-ups ------------------------------------------------------------------------------

TEST(BesideTheModel, ALateWakeUpIsInR) {
    SimConfig config = one_core();
    config.wake_latency = 2ms;
    for (const Nanoseconds budget : {98ms, 99ms}) {
        SketchBench sketch;
        sketch.add_loop(1, budget, 100ms, 0, computing(sketch, budget));
        ASSERT_EQ(sketch.begin(config).ok(), budget == 98ms);
        if (budget == 99ms) continue;
        EXPECT_EQ(response_of(sketch, 1), 100ms);
        sketch.run(2s);
        expect_met(sketch, 1);
    }
}

// ---- edges --------------------------------------------------------------------------------------

/// A handler's pin that is written every `apart`, from another core; a loop of `budget` in 100 ms
/// beside the handler.
class Edges {
  public:
    Edges(Nanoseconds budget, Nanoseconds apart) {
        sketch.add_loop(1, budget, 100ms, 0, computing(sketch, budget));
        sketch.add_loop(
            2, apart / 2, apart, 1, +[] {
                static bool level = false;
                digitalWrite(kPin, level = !level);
                waitForNextPeriod();
            });
        sketch.set_setup([] {
            pinMode(kPin, OUTPUT);
            qduino::arduino::attach_interrupt_vcpu(
                kPin, [] {}, CHANGE, 10us, 1ms, 0);
        });
    }
    Result<void> begin(Nanoseconds interval) {
        SimConfig config;
        config.edge_top_half = 100us;
        config.edge_interval = interval;
        return sketch.begin(config);
    }
    SketchBench sketch;
};

TEST(BesideTheModel, EdgesOfAnUnknownRateAreRefused) {
    EXPECT_NE(words_of(Edges(50ms, 1ms).begin(0ms)).find("edge_interval"), std::string::npos);
}

TEST(BesideTheModel, EachEdgeIsInR) {
    EXPECT_FALSE(Edges(95ms, 1ms).begin(1ms));
    Edges edges(85ms, 1ms);
    ASSERT_TRUE(edges.begin(1ms));
    edges.sketch.run(2s);
    expect_met(edges.sketch, 1);
}

/// They come ten times as often as the board file says: they are held back.
TEST(BesideTheModel, EdgesThatComeTooOftenAreHeldBack) {
    Edges edges(85ms, 100us);
    ASSERT_TRUE(edges.begin(1ms));
    edges.sketch.run(2s);
    expect_met(edges.sketch, 1);
    EXPECT_GT(edges.sketch.board().lost_edges(), 10'000u);
    EXPECT_GT(edges.sketch.board().tally(0).edges.count, 1'900u);
}

// ---- interrupts that a budget pays for ----------------------------------------------------------

TEST(BesideTheModel, ABudgetThatPaysForInterruptsHasSoMuchMore) {
    SimConfig config = one_core();
    config.charge_interrupts_to_victim = true;
    config.interrupts.push_back(
        {.rate_hz = 1000, .arrival = board::sim::Arrival::periodic, .top_half = 50us});
    SketchBench sketch;
    sketch.add_loop(1, 50ms, 100ms, 0, computing(sketch, 50ms));
    sketch.add_loop(2, 20ms, 200ms, 0, computing(sketch, 20ms));
    ASSERT_TRUE(sketch.begin(config));
    EXPECT_EQ(response_of(sketch, 1), 52'650us);
    sketch.run(4s);
    expect_met(sketch, 1);
    expect_met(sketch, 2);
    EXPECT_GT(sketch.board().cpu_time(1), 40 * 52ms) << "the interrupts were charged to it";
}

// ---- sleeps in many pieces ----------------------------------------------------------------------

/// A loop that sleeps 20 times in a release, above one that only computes.
class Sleeper {
  public:
    explicit Sleeper(Nanoseconds declared, int sleeps = 0) {
        sketch.add_loop(
            1, 1ms, 10ms, 0,
            [this] {
                for (int i = 0; i < 20; ++i) {
                    delayUntil(timeNow() + 100us);
                    sketch.board().compute(45us);
                }
                waitForNextPeriod();
            },
            declared);
        sketch.add_loop(2, 85ms, 100ms, 0, computing(sketch, 85ms));
        if (sleeps > 0) sketch.says_sleeps(1, sleeps);
    }
    Result<void> begin() {
        SimConfig config = one_core();
        config.costs.context_switch = 50us;
        return sketch.begin(config);
    }
    SketchBench sketch;
};

TEST(BesideTheModel, ALoopThatSleepsMoreOftenThanItSaysPaysForTheSwitches) {
    for (const Nanoseconds declared : {0ms, 5ms}) {
        Sleeper sleeper(declared);
        ASSERT_TRUE(sleeper.begin());
        sleeper.sketch.run(3s);
        expect_met(sleeper.sketch, 2);
        EXPECT_LT(response_of(sleeper.sketch, 2), 100ms);
    }
}

/// Admission has counted a switch to it in each period, whatever it comes back from: it pays for
/// none that is no more often.
TEST(BesideTheModel, ALoopThatComesBackOnceInAPeriodPaysForNoSwitch) {
    SimConfig config = one_core();
    config.costs.context_switch = 50us;
    SketchBench sketch;
    sketch.add_loop(1, 1ms, 10ms, 0, [&] { sketch.board().compute(100us); });  // never waits
    sketch.add_loop(2, 1ms, 20ms, 0, [&] {
        sketch.board().compute(800us);
        delayUntil(timeNow() + 20ms);  // and ends no release
    });
    sketch.add_loop(3, 40ms, 100ms, 0, computing(sketch, 40ms));
    ASSERT_TRUE(sketch.begin(config));
    sketch.run(2s);
    expect_met(sketch, 3);
    EXPECT_GE(sketch.statistics(1).passes.get(), 10 * 199) << "a whole budget of each period";
    const Nanoseconds each = sketch.board().cpu_time(2) / sketch.statistics(2).passes.get();
    EXPECT_LT(each, 810us);
}

TEST(BesideTheModel, SleepsThatAreDeclaredCount) { EXPECT_FALSE(Sleeper(5ms, 20).begin()); }

/// Each piece of a sleep can be blocked again: their number must be said.
TEST(BesideTheModel, ASleepInPiecesBesideALockIsRefusedWithoutTheirNumber) {
    for (const int sleeps : {0, 6}) {
        SketchBench sketch;
        Mutex mutex;
        sketch.add_loop(
            1, 2ms, 20ms, 0,
            [&] {
                for (int i = 0; i < 6; ++i) {
                    delayUntil(timeNow() + 500us);
                    mutex.lock();
                    sketch.board().compute(300us);
                    mutex.unlock();
                }
                waitForNextPeriod();
            },
            3ms);
        sketch.add_loop(2, 20ms, 100ms, 0, [&] {
            for (int i = 0; i < 10; ++i) {
                mutex.lock();
                sketch.board().compute(2ms);
                mutex.unlock();
            }
            waitForNextPeriod();
        });
        if (sleeps > 0) sketch.says_sleeps(1, sleeps);
        sketch.set_setup([&] {
            mutex.heldBy(1, 300us);
            mutex.heldBy(2, 2ms);
        });
        const Result<void> begun = sketch.begin(one_core());
        if (sleeps == 0) {
            EXPECT_NE(words_of(begun).find("scenario.ino:1: loop 1 sleeps"), std::string::npos)
                << words_of(begun);
            continue;
        }
        ASSERT_TRUE(begun);
        EXPECT_EQ(response_of(sketch, 1), 2ms + 3ms + 7 * 2ms);
        sketch.run(2s);
        expect_met(sketch, 1);
    }
}

// ---- who pays for a holder ----------------------------------------------------------------------

/// A loop that takes the mutex for `held` of its budget, behind `before` of it.
SketchBench::Body locking(SketchBench& sketch, Mutex& mutex, Nanoseconds before, Nanoseconds held,
                          Nanoseconds behind) {
    return [&sketch, &mutex, before, held, behind] {
        sketch.board().compute(before);
        mutex.lock();
        sketch.board().compute(held);
        mutex.unlock();
        sketch.board().compute(behind);
        waitForNextPeriod();
    };
}

/// A tick at the release of the holder, which computes less in some releases. Its server begins
/// when it was due, so it has its budget in the section, and loop 2, which waits, pays nothing.
TEST(BesideTheModel, AnInterruptAtTheReleaseOfAHolderCostsItsWaiterNothing) {
    SimConfig config = one_core();
    config.tick_period = 9ms;
    config.tick_cost = 1ms;
    SketchBench sketch;
    Mutex mutex;
    int release = 0;
    const auto whole = locking(sketch, mutex, 0ms, 900us, 100us);
    sketch.add_loop(1, 1ms, 10ms, 0, [&, whole] {
        if (++release % 8 != 2) return whole();
        sketch.board().compute(500us);
        waitForNextPeriod();
    });
    sketch.add_loop(2, 20ms, 40ms, 0, locking(sketch, mutex, 15'700us, 10us, 4290us));
    sketch.add_loop(3, 22'900us, 80ms, 0, computing(sketch, 22'900us));
    sketch.set_setup([&] {
        mutex.heldBy(1, 900us);
        mutex.heldBy(2, 10us);
    });
    ASSERT_TRUE(sketch.begin(config));
    EXPECT_EQ(response_of(sketch, 2), 26ms);
    sketch.run(10s);
    for (const VcpuId loop : {1, 2, 3}) expect_met(sketch, loop);
}

/// Loop 2 computes more than it says, and has a lock when its budget ends. Loop 1, which shares it,
/// pays; loop 3 does not, however little room it has.
TEST(BesideTheModel, AHolderThatOverrunsCostsNobodyWhoSharesNoLockWithIt) {
    SketchBench sketch;
    Mutex mutex;
    sketch.add_loop(1, 5ms, 10ms, 0, locking(sketch, mutex, 4500us, 100us, 400us));
    sketch.add_loop(2, 2ms, 20ms, 0, locking(sketch, mutex, 1800us, 1ms, 0ms));  // 0.8 ms too much
    sketch.add_loop(3, 24ms, 60ms, 0, computing(sketch, 24ms));
    sketch.set_setup([&] {
        mutex.heldBy(1, 100us);
        mutex.heldBy(2, 1ms);
    });
    ASSERT_TRUE(sketch.begin(one_core()));
    EXPECT_EQ(response_of(sketch, 1), 6ms);
    EXPECT_EQ(response_of(sketch, 3), 24ms + 6 * 5ms + 3 * 2ms);
    sketch.run(3s);
    expect_met(sketch, 3);
    EXPECT_GT(sketch.statistics(2).overruns.get(), 0);
    EXPECT_GT(sketch.statistics(1).overruns.get(), 0) << "nobody else can pay";
}

// ---- handlers that hold a lock ------------------------------------------------------------------

Mutex* handlers_mutex = nullptr;
SketchBench* handlers_bench = nullptr;
Nanoseconds handlers_section{};

void handle() {
    handlers_mutex->lock();
    handlers_bench->board().compute(handlers_section);
    handlers_mutex->unlock();
}

/// A handler with little budget holds a lock for `section`, which loop 1 wants.
class Handler {
  public:
    Handler(Nanoseconds section, bool says_so) {
        handlers_mutex = &mutex;
        handlers_bench = &sketch;
        handlers_section = section;
        sketch.add_loop(1, 2ms, 10ms, 0, [this] {
            sketch.board().compute(1900us);
            mutex.lock();
            sketch.board().compute(100us);
            mutex.unlock();
            waitForNextPeriod();
        });
        sketch.add_loop(2, 2ms, 40ms, 0, computing(sketch, 2ms));
        sketch.add_loop(
            3, 1ms, 20ms, 1, +[] {
                static bool level = false;
                digitalWrite(kPin, level = !level);
                waitForNextPeriod();
            });
        sketch.set_setup([this, says_so] {
            pinMode(kPin, OUTPUT);
            mutex.heldBy(1, 100us);
            if (says_so) mutex.heldBy(handle, handlers_section);
            qduino::arduino::attach_interrupt_vcpu(kPin, handle, CHANGE, 500us, 10ms, 0);
        });
    }
    Mutex mutex;
    SketchBench sketch;
};

TEST(BesideTheModel, AHandlersSectionIsInR) {
    Handler handler(4ms, true);
    ASSERT_TRUE(handler.sketch.begin());
    // A service of the handler, a twentieth of the rest, and a section of it:
    // R = 2 + 4 + 0.5 + 0.05·(R − 0.5).
    EXPECT_EQ(response_of(handler.sketch, 1), 6'815'790ns);
    handler.sketch.run(3s);
    expect_met(handler.sketch, 1);
    expect_met(handler.sketch, 2);
    // It may wait for loop 1 itself, which comes three times, each time with its wait.
    EXPECT_EQ(handler.sketch.runtime().plan().admission().cores[0].ios[0].response, 600us + 3 * 6ms);
}

TEST(BesideTheModel, AHandlersSectionThatIsTooLongIsRefused) {
    Handler handler(8ms, true);
    EXPECT_FALSE(handler.sketch.begin());
}

TEST(BesideTheModel, AHandlerOfAnotherCoreIsRefused) {
    SketchBench sketch;
    Mutex mutex;
    sketch.add_loop(1, 2ms, 10ms, 0, waitForNextPeriod);
    sketch.add_loop(2, 2ms, 10ms, 1, waitForNextPeriod);
    sketch.set_setup([&] {
        mutex.heldBy(1, 100us);
        mutex.heldBy(handle, 100us);
        qduino::arduino::attach_interrupt_vcpu(kPin, handle, CHANGE, 500us, 10ms, 1);
    });
    EXPECT_NE(words_of(sketch.begin()).find("shares a lock with loop 1, which is on another core"),
              std::string::npos);
}

// ---- locks that nobody speaks of ----------------------------------------------------------------

/// Loop 1, 2 of 10 ms, and loop 2, which has the same lock for 20 ms of its 20 in 100.
template <typename Take, typename Give>
class Shared {
  public:
    Shared(Take take, Give give) {
        const auto body = [=, this](Nanoseconds before, Nanoseconds held) {
            return [=, this] {
                sketch.board().compute(before);
                take();
                sketch.board().compute(held);
                give();
                waitForNextPeriod();
            };
        };
        sketch.add_loop(1, 2ms, 10ms, 0, body(1ms, 1ms));
        sketch.add_loop(2, 20ms, 100ms, 0, body(0ms, 20ms));
    }
    SketchBench sketch;
};

TEST(BesideTheModel, ATransactionOnSpiMayLastAWholeBudget) {
    SPIClass bus{0};
    Shared shared([&] { bus.beginTransaction(SPISettings()); }, [&] { bus.endTransaction(); });
    shared.sketch.set_setup([&] { bus.begin(); });
    EXPECT_FALSE(shared.sketch.begin(one_core()));
    EXPECT_EQ(response_of(shared.sketch, 1), 22ms);
}

// Its sketches come from elsewhere, and would all be refused. The check names it (e2e.qduino).
TEST(BesideTheModel, AMutexOfFreeRtosThatSaysNothingDoesNotCount) {
    using arduino::freertos::Semaphore;
    Semaphore mutex(Semaphore::Kind::mutex, 1, 1), counts(Semaphore::Kind::counting, 1, 1);
    Shared shared([&] { mutex.take(arduino::freertos::kForeverTicks); }, [&] { mutex.give(); });
    ASSERT_TRUE(shared.sketch.begin(one_core()));
    EXPECT_EQ(response_of(shared.sketch, 1), 2ms);
}

TEST(BesideTheModel, AMutexOfFreeRtosCountsAsItSays) {
    using arduino::freertos::Semaphore;
    Semaphore mutex(Semaphore::Kind::mutex, 1, 1);
    Shared shared([&] { mutex.take(arduino::freertos::kForeverTicks); }, [&] { mutex.give(); });
    shared.sketch.set_setup([&] {
        mutex.heldBy(1, 1ms);
        mutex.heldBy(2, 3ms);
    });
    ASSERT_TRUE(shared.sketch.begin(one_core()));
    EXPECT_EQ(response_of(shared.sketch, 1), 5ms);
}

TEST(BesideTheModel, WireCountsAsLongAsItsBusTakes) {
    SimConfig config = one_core();
    config.costs.i2c_per_byte = 90us;
    for (const bool says_so : {false, true}) {
        SketchBench sketch;
        TwoWire bus{0};
        sketch.add_loop(1, 1ms, 5ms, 0, [&] {
            bus.beginTransmission(0x48);
            bus.write(1);
            bus.endTransmission();
            waitForNextPeriod();
        });
        sketch.add_loop(2, 15ms, 40ms, 0, [&] {
            for (int k = 0; k < 5; ++k) {
                bus.beginTransmission(0x50);
                for (int i = 0; i < 30; ++i) bus.write(i);
                bus.endTransmission();
            }
            waitForNextPeriod();
        });
        sketch.set_setup([&] {
            bus.begin();
            if (!says_so) return;
            bus.heldBy(1, 200us);
            bus.heldBy(2, 2880us);
        });
        ASSERT_EQ(sketch.begin(config).ok(), says_so);
        EXPECT_EQ(response_of(sketch, 1), 1ms + (says_so ? 2880us : 65 * 90us));
        if (!says_so) continue;
        sketch.run(4s);
        expect_met(sketch, 1);
        expect_met(sketch, 2);
    }
}

// ---- numbers of a declaration -------------------------------------------------------------------

TEST(BesideTheModel, NumbersThatCannotBeAreRefusedWithTheirPlace) {
    const auto refusal = [](auto declare, Nanoseconds sleep = {}) {
        SketchBench sketch;
        Mutex mutex;
        sketch.add_loop(1, 1ms, 10ms, 0, waitForNextPeriod, sleep);
        sketch.add_loop(2, 1ms, 10ms, 0, waitForNextPeriod);
        sketch.set_setup([&] { declare(mutex); });
        return words_of(sketch.begin());
    };
    EXPECT_EQ(refusal([](Mutex&) {}), "");
    const std::string here = __FILE__;
    EXPECT_NE(refusal([](Mutex& m) { m.heldBy(3, 1ms); }).find("names loop 3"), std::string::npos);
    EXPECT_NE(refusal([](Mutex& m) { m.heldBy(257, 1ms); }).find("names loop 257"), std::string::npos);
    EXPECT_NE(refusal([](Mutex& m) { m.heldBy(1, -1ms); }).find("a length is 0 to 24 h"), std::string::npos);
    EXPECT_NE(refusal([](Mutex& m) { m.heldBy(1, -1ms); }).find(here + ":"), std::string::npos);
    EXPECT_NE(refusal([](Mutex& m) { m.heldBy(handle, 1ms); }).find("a handler that no pin has"),
              std::string::npos);
    EXPECT_NE(refusal([](Mutex&) {}, -1ms).find("scenario.ino:1: loop 1 sleeps -1 ms"), std::string::npos)
        << refusal([](Mutex&) {}, -1ms);
    EXPECT_NE(refusal([](Mutex&) {}, 11ms).find("not within 0 and its period"), std::string::npos);
}

}  // namespace
}  // namespace qduino::guarantee::beside_the_model_test
