// Interrupt sources: what they take from whom, where they go, and what breaks them.
#include <gtest/gtest.h>

#include "sim_fixture.h"

namespace qduino::board::sim::testing::sim_interrupts_test {
namespace {

using Burst = KeptTrace::Burst;

SimConfig with_source(InterruptSource source) {
    SimConfig config;
    config.interrupts.push_back(source);
    return config;
}

/// 1 kHz exactly, the first at 1 ms.
InterruptSource timer_like(Nanoseconds top_half, Nanoseconds bottom_half = Nanoseconds{0}, int core = 0) {
    return {.device = DeviceClass::nic,
            .rate_hz = 1000,
            .arrival = Arrival::periodic,
            .core = core,
            .top_half = top_half,
            .bottom_half = bottom_half};
}

std::size_t interrupts_of(const KeptTrace& trace, int core) {
    std::size_t n = 0;
    for (const TraceEvent& event : trace.events)
        n += event.kind == TraceKind::interrupt && event.core == core;
    return n;
}

TEST(SimInterrupts, ATopHalfDelaysWhateverRunsAndCostsItNoBudget) {
    NoPeripherals wires;
    SimBoard board(with_source(timer_like(50us)), wires);
    Program program;
    Instant computed = kEpoch, spun = kEpoch;
    program.loop(1, 50ms, 100ms, 0, [&] {
        board.compute(10ms);  // ten interrupts of 50 us begin in it: at 1, 2 … 10 ms
        computed = board.now();
        board.busy_until(at(11ms + 20us));  // a spin ends on time, or when the interrupt does
        spun = board.now();
    });
    ASSERT_TRUE(board.start(program.specs()));
    board.run(at(1s));
    EXPECT_EQ(computed, at(10ms + 10 * 50us));
    EXPECT_EQ(spun, at(11ms + 50us));
    EXPECT_EQ(board.cpu_time(1), Nanoseconds{11ms - 10 * 50us});
}

TEST(SimInterrupts, TheVictimPaysWhereTheKernelDoesNotTellThemApart) {
    NoPeripherals wires;
    SimConfig config = with_source(timer_like(100us));
    config.charge_interrupts_to_victim = true;
    KeptTrace trace;
    SimBoard board(config, wires, &trace);
    Program program;
    program.loop(1, 30ms, 100ms, 0, [&] { board.busy_until(kForever); });
    ASSERT_TRUE(board.start(program.specs()));
    board.run(at(1s));
    for (const Burst& burst : trace.bursts(1)) EXPECT_LE(burst.end - burst.begin, Nanoseconds{30ms + 100us});
    // The interrupt at 30 ms is ended first.
    EXPECT_EQ(trace.bursts(1).front(), (Burst{at(0ms), at(30ms + 100us)}));
}

TEST(SimInterrupts, ALoopOnAnotherCoreIsNotTouched) {
    NoPeripherals wires;
    SimBoard board(with_source(timer_like(200us, 300us, 0)), wires);
    Program program;
    Instant disturbed = kEpoch, free = kEpoch;
    program
        .loop(1, 50ms, 100ms, 0,
              [&] {
                  board.compute(20ms);
                  disturbed = board.now();
              })
        .owning_loop(2, 100us, 1, [&] {
            board.compute(20ms);
            free = board.now();
        });
    ASSERT_TRUE(board.start(program.specs()));
    board.run(at(1s));
    EXPECT_EQ(free, at(20ms));
    // 39 at 1 … 39 ms: nobody serves them, so they run at once.
    EXPECT_EQ(disturbed, at(20ms + 39 * 500us));
    EXPECT_EQ(board.stolen_time(1), Nanoseconds{0});
}

TEST(SimInterrupts, ABottomHalfRunsOnItsIoVcpuWithinItsBudget) {
    NoPeripherals wires;
    KeptTrace trace;
    SimBoard board(with_source(timer_like(10us, 900us)), wires, &trace);  // wants 90 % of the core
    Program program;
    Instant done = kEpoch;
    program.io(40, 1ms, 10ms, 0).loop(1, 40ms, 100ms, 0, [&] {
        board.compute(40ms);
        done = board.now();
        board.sleep_until(kForever);
    });
    ASSERT_TRUE(board.serve_interrupts(DeviceClass::nic, 40));
    ASSERT_TRUE(board.start(program.specs()));
    board.run(at(200ms));
    // (2 − U)·U of a period at most: a tenth, and one budget more in the first window.
    EXPECT_LE(board.cpu_time(40), Nanoseconds{20ms + 1ms});
    EXPECT_GE(board.cpu_time(40), Nanoseconds{18ms});
    EXPECT_LE(done, at(50ms));
    for (const Burst& burst : trace.bursts(40)) EXPECT_LE(burst.end - burst.begin, Nanoseconds{1ms + 10us});
}

TEST(SimInterrupts, ABottomHalfHasTheBudgetThatItIsGivenWhileItRuns) {
    NoPeripherals wires;
    SimBoard board(with_source(timer_like(10us, 900us)), wires);  // wants 90 % of the core
    Program program;
    std::vector<Nanoseconds> used;
    program.io(40, 1ms, 10ms, 0).loop(1, 1ms, 100ms, 1, [&] {
        for (const Nanoseconds budget : {Nanoseconds{5ms}, Nanoseconds{500us}, Nanoseconds{1ms}}) {
            board.sleep_until(board.now() + 1s);
            used.push_back(board.cpu_time(40));
            EXPECT_TRUE(board.change_io(40, {budget, 10ms}));
        }
        EXPECT_FALSE(board.change_io(1, {1ms, 10ms}));
        EXPECT_FALSE(board.change_io(41, {1ms, 10ms}));
    });
    ASSERT_TRUE(board.serve_interrupts(DeviceClass::nic, 40));
    ASSERT_TRUE(board.start(program.specs()));
    board.run(at(3100ms));
    ASSERT_EQ(used.size(), 3u);
    // Shares of a second, and a service of 10 ms at either end.
    EXPECT_NEAR(to_seconds(used[0]), 0.1, 0.001);
    EXPECT_NEAR(to_seconds(used[1] - used[0]), 0.5, 0.005);
    EXPECT_NEAR(to_seconds(used[2] - used[1]), 0.05, 0.005);
    EXPECT_EQ(board.guarantee().loops[1].budget, 1ms);
}

/// Loop 1 (10 ms) uses a device that takes 1 ms for it. Loop 2 (20 ms) computes. The device's I/O
/// VCPU has a tenth.
class ALoopWithADevice : public ::testing::TestWithParam<DeviceClass> {
  protected:
    void run(bool served) {
        SimConfig config;
        config.costs.i2c_per_byte = config.costs.uart_per_byte = config.costs.nic_per_byte = 500us;
        NoPeripherals wires;
        SimBoard board(config, wires);
        Program program;
        program.io(40, 5ms, 50ms, 0)
            .loop(1, 4ms, 10ms, 0,
                  [&] {
                      use(board);
                      done = board.now();
                      slept = board.slept();
                      board.sleep_until(kForever);
                  })
            .loop(2, 15ms, 20ms, 0, [&] { board.compute(15ms); });
        const VcpuId server = served ? VcpuId{40} : kNoVcpu;
        EXPECT_TRUE(board.serve_interrupts(GetParam(), server));
        ASSERT_TRUE(board.start(program.specs()));
        board.run(at(100ms));
        by_loop = board.cpu_time(1);
        by_io = board.cpu_time(40);
    }
    /// Two bytes; one is the address, on I2C.
    static void use(SimBoard& board) {
        std::array<std::uint8_t, 1> byte{};
        if (GetParam() == DeviceClass::i2c) {
            static_cast<void>(board.i2c_transfer({1}, {0x48}, byte, {}));
        } else {
            board.device_work(GetParam(), 2);
        }
    }
    Instant done;
    Nanoseconds slept{}, by_loop{}, by_io{};
};

TEST_P(ALoopWithADevice, PaysForItItselfWhereNobodyServesTheDevice) {
    run(false);
    EXPECT_EQ(done, at(1ms));
    EXPECT_EQ(by_loop, 1ms);
    EXPECT_EQ(by_io, Nanoseconds{0});
}

TEST_P(ALoopWithADevice, HasItDoneAtItsOwnRankByTheIoVcpuAndSleepsMeanwhile) {
    run(true);
    // At its own 50 ms the I/O VCPU would wait for the 15 ms of loop 2.
    EXPECT_EQ(done, at(1ms));
    EXPECT_EQ(by_loop, Nanoseconds{0});
    EXPECT_EQ(by_io, 1ms) << "U·T of the client: a tenth of 10 ms";
    EXPECT_EQ(slept, 1ms) << "which admission counts as a sleep";
}

INSTANTIATE_TEST_SUITE_P(Sim, ALoopWithADevice,
                         ::testing::Values(DeviceClass::i2c, DeviceClass::uart, DeviceClass::nic));

TEST(SimInterrupts, WithoutAnIoVcpuTheBottomHalfRunsAboveEveryLoop) {
    NoPeripherals wires;
    SimBoard board(with_source(timer_like(10us, 900us)), wires);
    Program program;
    Instant done = kEpoch;
    program.loop(1, 100ms, 100ms, 0, [&] {
        board.compute(4ms);
        done = board.now();
    });
    ASSERT_TRUE(board.start(program.specs()));
    board.run(at(1s));
    // 1 ms, then 90 us of every millisecond: 3 ms of work take 33 more of them, and 30 us of a
    // 34th.
    EXPECT_EQ(done, at(1ms + 33 * 1ms + 910us + 30us));
}

TEST(SimInterrupts, RoutingMovesThemToACoreThatTakesThem) {
    NoPeripherals wires;
    KeptTrace trace;
    SimBoard board(with_source(timer_like(10us, Nanoseconds{0}, 1)), wires, &trace);
    Program program;
    program.loop(1, 10ms, 100ms, 0, [&] {
        board.sleep_until(at(10ms + 1us));
        EXPECT_TRUE(board.route_interrupts(DeviceClass::nic, 1, false));
        board.sleep_until(at(30ms + 1us));
        EXPECT_FALSE(board.route_interrupts(DeviceClass::all, 0, false));  // then nobody would
        EXPECT_TRUE(board.route_interrupts(DeviceClass::all, 1, true));
        board.sleep_until(at(35ms + 1us));
        board.request_stop();
    });
    ASSERT_TRUE(board.start(program.specs()));
    board.run(at(1s));
    EXPECT_EQ(interrupts_of(trace, 1), 10u + 5u);
    EXPECT_EQ(interrupts_of(trace, 0), 20u);
}

TEST(SimInterrupts, TheTickStopsOnlyOnACoreThatALoopOwns) {
    NoPeripherals wires;
    KeptTrace trace;
    SimConfig config;
    config.tick_period = 4ms;
    config.tick_cost = 5us;
    SimBoard board(config, wires, &trace);
    Program program;
    program.loop(1, 10ms, 100ms, 0, [&] { board.sleep_until(at(100ms + 1us)); })
        .owning_loop(2, 100us, 1, [&] {
            board.busy_until(at(20ms + 1us));
            EXPECT_TRUE(board.core_timer(1, false));
            EXPECT_FALSE(board.core_timer(0, false));
            board.busy_until(at(50ms));
            EXPECT_TRUE(board.core_timer(1, true));  // the next on its grid is at 52 ms
            board.busy_until(at(60ms + 1us));
        });
    ASSERT_TRUE(board.start(program.specs()));
    EXPECT_FALSE(board.guarantee().cores[1].tick_stopped);
    board.run(at(1s));
    EXPECT_EQ(interrupts_of(trace, 0), 25u);
    EXPECT_EQ(interrupts_of(trace, 1), 5u + 3u + 10u);  // to 20 ms; 52, 56, 60 ms; 64 … 100 ms
}

TEST(SimInterrupts, APoissonSourceHasItsRate) {
    NoPeripherals wires;
    KeptTrace trace;
    InterruptSource source = timer_like(1us);
    source.arrival = Arrival::poisson;
    SimBoard board(with_source(source), wires, &trace);
    Program program;
    program.loop(1, 10ms, 100ms, 0, [&] { board.sleep_until(at(20s)); });
    ASSERT_TRUE(board.start(program.specs()));
    board.run(at(20s));
    const double count = static_cast<double>(interrupts_of(trace, 0));
    // Four standard deviations of a Poisson count; the seed is fixed.
    EXPECT_NEAR(count, 20'000, 4 * 142);
    // The gaps of a Poisson process vary as much as their mean.
    double mean = 0, square = 0;
    std::vector<double> gaps;
    Instant last = kEpoch;
    for (const TraceEvent& event : trace.events) {
        if (event.kind != TraceKind::interrupt) continue;
        gaps.push_back(to_seconds(event.time - last));
        last = event.time;
    }
    for (const double gap : gaps) mean += gap / static_cast<double>(gaps.size());
    for (const double gap : gaps) square += (gap - mean) * (gap - mean) / static_cast<double>(gaps.size());
    EXPECT_NEAR(square / (mean * mean), 1.0, 0.06);
}

TEST(SimInterrupts, ALostInterruptNeverComesAndAStuckOneStorms) {
    NoPeripherals wires;
    KeptTrace trace;
    InterruptSource lost = timer_like(1us);
    lost.lost_from = at(10ms);
    InterruptSource stuck = timer_like(1us, Nanoseconds{0}, 1);
    stuck.stuck_from = at(10ms);
    stuck.stuck_rate_hz = 100'000;
    SimConfig config = with_source(lost);
    config.interrupts.push_back(stuck);
    SimBoard board(config, wires, &trace);
    Program program;
    program.loop(1, 10ms, 100ms, 0, [&] { board.sleep_until(at(20ms + 1us)); });
    ASSERT_TRUE(board.start(program.specs()));
    board.run(at(1s));
    EXPECT_EQ(interrupts_of(trace, 0), 9u);
    EXPECT_EQ(interrupts_of(trace, 1), 10u + 1000u);
}

TEST(SimInterrupts, AStormOnOneCoreLeavesTheOwnedOneAlone) {
    NoPeripherals wires;
    InterruptSource storm = timer_like(8us, 4us);
    storm.stuck_from = at(1ms);  // 12 us every 10: core 0 is lost
    SimBoard board(with_source(storm), wires);
    Program program;
    int releases = 0;
    bool first_ended = false;
    program
        .loop(1, 10ms, 100ms, 0,
              [&] {
                  board.compute(5ms);
                  first_ended = true;
              })
        .owning_loop(2, 100us, 1, [&] {
            for (Instant t = at(100us); t <= at(1s); t += 100us) {
                board.busy_until(t);
                ASSERT_EQ(board.now(), t);
                ++releases;
            }
        });
    ASSERT_TRUE(board.start(program.specs()));
    board.run(at(2s));
    EXPECT_EQ(releases, 10'000);
    EXPECT_FALSE(first_ended);
}

TEST(SimInterrupts, AContextSwitchTakesItsTime) {
    NoPeripherals wires;
    SimConfig config;
    config.costs.context_switch = 10us;
    SimBoard board(config, wires);
    Program program;
    std::vector<Instant> ends;
    program.loop(1, 50ms, 100ms, 0, [&] {
        board.compute(5ms);
        ends.push_back(board.now());
    });
    program.loop(2, 1020us, 10ms, 0, [&] {
        board.sleep_until(at(2ms));
        board.compute(1ms);
        ends.push_back(board.now());
    });
    ASSERT_TRUE(board.start(program.specs()));
    board.run(at(1s));
    // To 2 (it sleeps at once), to 1; at 2 ms to 2; when it has ended, back to 1.
    ASSERT_EQ(ends.size(), 2u);
    EXPECT_EQ(ends[0], at(2ms + 10us + 1ms));
    EXPECT_EQ(ends[1], at(10us + 10us + 5ms + 10us + 1ms + 10us));
    // It has declared no sleep, so it pays for the second switch to it, and for the one back.
    EXPECT_EQ(board.cpu_time(2), 1ms + 20us);
}

TEST(SimFaults, AnOverrunningLoopTakesTheExtraAtEachReleaseInItsWindow) {
    NoPeripherals wires;
    SimConfig config;
    config.loop_faults.push_back({.loop = 1, .from = at(100ms), .until = at(200ms), .extra = 3ms});
    SimBoard board(config, wires);
    Program program;
    std::vector<Nanoseconds> took;
    program.loop(1, 10ms, 20ms, 0, periodic_work(board, 2ms, 20ms, [&](Instant release, Instant end) {
                     took.push_back(end - release);
                 }));
    ASSERT_TRUE(board.start(program.specs()));
    board.run(at(400ms));
    ASSERT_EQ(took.size(), 20u);
    for (std::size_t k = 0; k < took.size(); ++k) {
        EXPECT_EQ(took[k], k >= 5 && k < 10 ? Nanoseconds{5ms} : Nanoseconds{2ms}) << k;
    }
}

TEST(SimFaults, AStuckPinReadsItsLevelAndLosesItsEdges) {
    class Button final : public ::qduino::board::NoPeripherals {
      public:
        bool report_edges_to(PinEdgeSink& sink) override { return sink_ = &sink, true; }
        Instant next_event(Instant) override { return next_; }
        void advance(Instant now) override {
            level_ = level_ == Level::low ? Level::high : Level::low;
            next_ = now + 1ms;
            sink_->pin_edge(now, PinId{3}, level_);
        }
        Level pin_level(Instant, PinId) override { return level_; }
        double analog_level(Instant, PinId) override { return 0.25; }
        Result<void> i2c_transfer(Instant, I2cBus, I2cAddress, std::span<const std::uint8_t>,
                                  std::span<std::uint8_t>) override {
            return {};
        }

      private:
        PinEdgeSink* sink_ = nullptr;
        Level level_ = Level::low;
        Instant next_ = at(1ms);
    } button;
    SimConfig config;
    config.stuck_pins.push_back({.pin = PinId{3}, .level = Level::high, .from = at(10ms), .until = at(20ms)});
    config.stuck_pins.push_back({.pin = PinId{9}, .level = Level::high, .from = at(10ms)});
    config.silent_chips.push_back({.bus = {1}, .address = {0x48}, .from = at(10ms), .until = at(20ms)});
    SimBoard board(config, button);
    Program program;
    int edges = 0;
    ASSERT_TRUE(board.attach_edge(
        PinId{3}, Edge::both, [](void* n) { ++*static_cast<int*>(n); }, &edges, 33));
    std::vector<int> edges_at;
    program.io(33, 1ms, 10ms, 1).loop(1, 10ms, 100ms, 0, [&] {
        std::array<std::uint8_t, 1> in{};
        for (const Nanoseconds t :
             {Nanoseconds{9500us}, Nanoseconds{11500us}, Nanoseconds{12500us}, Nanoseconds{25500us}}) {
            board.sleep_until(at(t));
            edges_at.push_back(edges);
            const bool broken = t > 10ms && t < 20ms;
            if (broken) {
                EXPECT_EQ(board.pin_read(PinId{3}), Level::high);
            }
            EXPECT_EQ(board.analog_read(PinId{9}).value(), t > 10ms ? 1.0 : 0.25);
            EXPECT_EQ(board.i2c_transfer(I2cBus{1}, I2cAddress{0x48}, {}, in).ok(), !broken);
            EXPECT_TRUE(board.i2c_transfer(I2cBus{1}, I2cAddress{0x49}, {}, in));
        }
    });
    ASSERT_TRUE(board.start(program.specs()));
    board.run(at(1s));
    // 1 … 9 ms; from 20 ms on again: 20 … 25 ms.
    EXPECT_EQ(edges_at, (std::vector<int>{9, 9, 9, 9 + 6}));
}

TEST(SimEdges, TheHandlerPreemptsByItsOwnPeriodAndPaysFromItsOwnBudget) {
    NoPeripherals wires;
    KeptTrace trace;
    SimBoard board(SimConfig{}, wires, &trace);
    Program program;
    struct Context {
        SimBoard* board;
        std::vector<Instant> times;
    } context{&board, {}};
    program.io(33, 1ms, 10ms, 0).loop(1, 50ms, 100ms, 0, [&] {
        EXPECT_TRUE(board.pin_mode(PinId{1}, PinMode::output));
        EXPECT_TRUE(board.attach_edge(
            PinId{1}, Edge::rising,
            [](void* p) {
                auto& c = *static_cast<Context*>(p);
                c.times.push_back(c.board->now());
                c.board->compute(600us);
            },
            &context, 33));
        board.compute(1ms);
        for (int i = 0; i < 3; ++i) {  // three edges at once: 1.8 ms of handlers on 1 ms of budget
            board.pin_write(PinId{1}, Level::high);
            board.pin_write(PinId{1}, Level::low);
        }
        board.compute(20ms);
    });
    ASSERT_TRUE(board.start(program.specs()));
    board.run(at(100ms));
    ASSERT_EQ(context.times.size(), 3u);
    EXPECT_EQ(context.times[0], at(1ms));
    EXPECT_EQ(context.times[1], at(1ms + 600us));
    // 400 us of the second, then throttled until 1 + 1/0.1 = 11 ms.
    EXPECT_EQ(context.times[2], at(11ms + 200us));
    EXPECT_EQ(board.cpu_time(33), Nanoseconds{1800us});
    EXPECT_EQ(trace.count(TraceKind::throttle, 33), 1u);
    const GuaranteeReport report = board.guarantee();
    ASSERT_EQ(report.bottom_halves.size(), 1u);
    EXPECT_EQ(report.bottom_halves[0].id, 33);
    EXPECT_EQ(report.bottom_halves[0].timed, 3u);
    EXPECT_EQ(report.bottom_halves[0].begin_worst, 10'200us) << "all three came at 1 ms";
    EXPECT_EQ(report.bottom_halves[0].end_worst, 10'800us);
}

/// No loop's R has the turn to a handler that waited, and its activation is one turn only.
TEST(SimEdges, AHandlerThatWaitsForALockPaysForTheTurnBehindThat) {
    NoPeripherals wires;
    SimConfig config;
    config.costs.context_switch = 10us;
    SimBoard board(config, wires);
    Program program;
    struct Context {
        SimBoard* board;
        LockWord lock{};
        Instant end{};
    } context{&board, {}, {}};
    program.io(33, 1ms, 10ms, 0).loop(1, 50ms, 100ms, 0, [&] {
        EXPECT_TRUE(board.pin_mode(PinId{1}, PinMode::output));
        EXPECT_TRUE(board.attach_edge(
            PinId{1}, Edge::rising,
            [](void* p) {
                auto& c = *static_cast<Context*>(p);
                c.board->lock(c.lock);
                c.board->compute(100us);
                c.board->unlock(c.lock);
                c.end = c.board->now();
            },
            &context, 33));
        board.lock(context.lock);
        board.pin_write(PinId{1}, Level::high);
        board.compute(2ms);
        board.unlock(context.lock);
        board.compute(1ms);
    });
    ASSERT_TRUE(board.start(program.specs()));
    board.run(at(100ms));
    // To the loop, to the handler, back, and to the handler again.
    EXPECT_EQ(context.end, at(4 * 10us + 2ms + 100us));
    EXPECT_EQ(board.cpu_time(33), 100us + 2 * 10us);
}

TEST(SimEdges, MoreThanTheQueueHoldsAreCountedAsLost) {
    NoPeripherals wires;
    SimBoard board(SimConfig{}, wires);
    Program program;
    int handled = 0;
    program.io(33, 1ms, 10ms, 0).loop(1, 50ms, 100ms, 0, [&] {
        EXPECT_TRUE(board.pin_mode(PinId{1}, PinMode::output));
        EXPECT_TRUE(board.attach_edge(
            PinId{1}, Edge::rising, [](void* n) { ++*static_cast<int*>(n); }, &handled, 33));
        for (int i = 0; i < 300; ++i) {
            board.pin_write(PinId{1}, Level::high);
            board.pin_write(PinId{1}, Level::low);
        }
        board.compute(1ms);
    });
    ASSERT_TRUE(board.start(program.specs()));
    board.run(at(100ms));
    EXPECT_EQ(handled, 256);
    EXPECT_EQ(board.lost_edges(), 44u);
}

}  // namespace
}  // namespace qduino::board::sim::testing::sim_interrupts_test
