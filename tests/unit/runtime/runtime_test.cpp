// The runtime on the simulated board: releases to the nanosecond, overruns by policy, interrupts,
// and what it must not do.
#include "runtime/runtime.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "board/sim/sim_board.h"
#include "tests/unit/runtime/allocation_count.h"

namespace qduino {
void PrintTo(Instant t, std::ostream* out) { *out << to_ns(t) << " ns"; }
}  // namespace qduino

namespace qduino::runtime::runtime_test {
namespace {

using board::DeviceClass;
using board::Edge;
using board::Level;
using board::PinId;
using board::PinMode;
using board::sim::SimBoard;
using board::sim::SimConfig;
using ::qduino::testing::allocation_count;
using ::testing::HasSubstr;

constexpr Instant at(Nanoseconds since) { return kEpoch + since; }

/// Up to four loops whose bodies are lambdas: a sketch's bodies are plain functions, so these are
/// static.
class RuntimeTest : public ::testing::Test {
  protected:
    using Body = std::function<void()>;

    void SetUp() override { test = this; }
    void TearDown() override {
        runtime_.reset();
        test = nullptr;
    }

    void loop(board::VcpuId id, Nanoseconds budget, Nanoseconds period, int core, Body body) {
        constexpr std::array<void (*)(), 5> kBodies{nullptr, &call<1>, &call<2>, &call<3>, &call<4>};
        bodies_[id] = std::move(body);
        table_.loops.push_back({{id, budget, period, core}, kBodies.at(id), "test.ino", id});
    }
    void setup(Body body) {
        bodies_[0] = std::move(body);
        table_.setup = &call<0>;
    }
    Result<void> begin(SimConfig config = {}, RuntimeOptions options = {}) {
        board_ = std::make_unique<SimBoard>(std::move(config), wires_);
        runtime_ = std::make_unique<Runtime>(*board_, options);
        return runtime_->begin(table_);
    }
    void run(Nanoseconds length) { runtime_->run(at(length)); }
    Instant now() { return board_->now(); }
    void wait() { runtime_->wait_for_next_period(); }
    void busy(Nanoseconds length) { board_->compute(length); }
    const LoopStatistics& statistics(board::VcpuId id) { return runtime_->loop(id)->statistics; }
    board::LoopGuarantee guarantee_of(board::VcpuId id) const {
        const board::GuaranteeReport report = board_->guarantee();
        return *std::ranges::find(report.loops, id, &board::LoopGuarantee::id);
    }

    template <int Id>
    static void call() {
        test->bodies_[Id]();
    }
    static void count_edge() { ++test->edges_; }

    static inline RuntimeTest* test = nullptr;
    board::NoPeripherals wires_;
    SketchTable table_;
    std::array<Body, 5> bodies_;
    std::unique_ptr<SimBoard> board_;
    std::unique_ptr<Runtime> runtime_;
    int edges_ = 0;
};

TEST_F(RuntimeTest, ReleasesDoNotDrift) {
    std::vector<Instant> starts;
    loop(1, 5ms, 10ms, 0, [&] {
        starts.push_back(now());
        busy(Nanoseconds{static_cast<std::int64_t>(starts.size() % 5) * 1'000'003});
        wait();
    });
    ASSERT_TRUE(begin());
    run(1s);
    ASSERT_EQ(starts.size(), 100u);
    for (std::size_t k = 0; k < starts.size(); ++k)
        EXPECT_EQ(starts[k], at(10ms * static_cast<std::int64_t>(k)));
    EXPECT_EQ(statistics(1).releases.get(), 100);
    EXPECT_EQ(statistics(1).passes.get(), 100);
    EXPECT_EQ(statistics(1).overruns.get(), 0);
    EXPECT_EQ(statistics(1).release_latency_ns.count(), 100u);
    EXPECT_EQ(statistics(1).release_latency_ns.max(), 0u);
}

TEST_F(RuntimeTest, ABodyMayHoldALoopOfItsOwn) {
    std::vector<Instant> starts;
    loop(1, 5ms, 10ms, 0, [&] {
        for (;;) {
            starts.push_back(now());
            busy(1ms);
            wait();
        }
    });
    ASSERT_TRUE(begin());
    run(50ms);
    EXPECT_EQ(starts, (std::vector<Instant>{at(0ms), at(10ms), at(20ms), at(30ms), at(40ms)}));
}

TEST_F(RuntimeTest, ALoopThatStartsLateStaysOnTheCommonGrid) {
    std::vector<Instant> starts;
    loop(1, 4ms, 20ms, 0, [&] {
        starts.push_back(now());
        busy(1ms);
        wait();
    });
    loop(2, 3ms, 10ms, 0, [&] {
        busy(3ms);
        wait();
    });
    ASSERT_TRUE(begin());
    run(60ms);
    // Held up by loop 2, not shifted by it.
    EXPECT_EQ(starts, (std::vector<Instant>{at(3ms), at(23ms), at(43ms)}));
    EXPECT_EQ(statistics(1).release_latency_ns.max(), 3'000'000u);
    EXPECT_EQ(statistics(1).overruns.get(), 0);
}

TEST_F(RuntimeTest, ABodyThatDoesNotWaitIsCalledAgainAndAgain) {
    int passes = 0;
    loop(1, 80ms, 100ms, kAnyCore, [&] {
        ++passes;
        busy(7ms);
    });
    ASSERT_TRUE(begin());
    run(1s);
    EXPECT_EQ(passes, 115);  // 800 ms of 7 ms each, the last not ended
    EXPECT_EQ(board_->cpu_time(1), Nanoseconds{800ms});
    EXPECT_EQ(statistics(1).passes.get(), 115);
}

TEST_F(RuntimeTest, AnEmptyBodyDoesNotStopTime) {
    int passes = 0;
    loop(1, 80ms, 100ms, kAnyCore, [&] { ++passes; });
    ASSERT_TRUE(begin());
    run(1ms);
    EXPECT_EQ(now(), at(1ms));
    EXPECT_EQ(passes, 10'000);
}

TEST_F(RuntimeTest, AnOwningLoopsInstantsAreItsOwn) {
    std::vector<Instant> steps;
    loop(1, 100us, 100us, 1, [&] {
        const Instant start = now();
        board_->busy_until(start + 1us);
        steps.push_back(now());
        // The body took time: it is called again at once, and for nothing.
        board_->busy_until(start + 80us);
    });
    ASSERT_TRUE(begin());
    run(800us);
    ASSERT_EQ(steps.size(), 10u);
    for (std::size_t k = 0; k < steps.size(); ++k)
        EXPECT_EQ(steps[k], at(1us + 80us * static_cast<std::int64_t>(k)));
}

// ---- overruns -----------------------------------------------------------------------------------

class RuntimeOverrun : public RuntimeTest {
  protected:
    /// 2 ms of work in every 10 ms; the third release takes 25 ms.
    std::vector<Instant> starts_with(OverrunPolicy policy, OverrunHandler handler = nullptr) {
        std::vector<Instant> starts;
        loop(1, 10ms, 10ms, 0, [this, &starts] {
            starts.push_back(now());
            busy(starts.size() == 3 ? Nanoseconds{25ms} : Nanoseconds{2ms});
            wait();
        });
        setup([this, policy, handler] { runtime_->set_overrun_policy(1, policy, handler); });
        EXPECT_TRUE(begin());
        run(80ms);
        return starts;
    }
    static inline std::vector<std::pair<int, Nanoseconds>> told;
};

TEST_F(RuntimeOverrun, SkipKeepsThePhase) {
    EXPECT_EQ(starts_with(OverrunPolicy::skip),
              (std::vector<Instant>{at(0ms), at(10ms), at(20ms), at(50ms), at(60ms), at(70ms)}));
    EXPECT_EQ(statistics(1).overruns.get(), 1);
    EXPECT_EQ(statistics(1).dropped.get(), 2);
    EXPECT_EQ(statistics(1).lateness_ns_max.get(), 15'000'000);
    EXPECT_EQ(statistics(1).releases.get(), 6);
}

TEST_F(RuntimeOverrun, CatchUpRunsTheMissedOnesBackToBack) {
    EXPECT_EQ(starts_with(OverrunPolicy::catch_up),
              (std::vector<Instant>{at(0ms), at(10ms), at(20ms), at(45ms), at(47ms), at(50ms), at(60ms),
                                    at(70ms)}));
    // Those due at 20 and 30 ms; that of 40 ms ends before 50 ms.
    EXPECT_EQ(statistics(1).overruns.get(), 2);
    EXPECT_EQ(statistics(1).dropped.get(), 0);
    EXPECT_EQ(statistics(1).release_latency_ns.max(), 15'000'000u);
}

TEST_F(RuntimeOverrun, KeepPhaseDoesNotCountTheLateRelease) {
    EXPECT_EQ(starts_with(OverrunPolicy::keep_phase),
              (std::vector<Instant>{at(0ms), at(10ms), at(20ms), at(50ms), at(60ms), at(70ms)}));
    EXPECT_EQ(statistics(1).releases.get(), 5);
    EXPECT_EQ(statistics(1).overruns.get(), 1);
}

TEST_F(RuntimeOverrun, CallBackTellsTheHandlerHowLate) {
    told.clear();
    EXPECT_EQ(starts_with(OverrunPolicy::call_back,
                          [](board::VcpuId id, Nanoseconds lateness) { told.emplace_back(id, lateness); })
                  .size(),
              6u);
    EXPECT_EQ(told, (std::vector<std::pair<int, Nanoseconds>>{{1, Nanoseconds{15ms}}}));
}

TEST_F(RuntimeOverrun, StopStopsTheSketchThroughItsSafeStates) {
    EXPECT_EQ(starts_with(OverrunPolicy::stop), (std::vector<Instant>{at(0ms), at(10ms), at(20ms)}));
    EXPECT_TRUE(board_->stopped());
    EXPECT_LE(now(), at(50ms));
}

// ---- begin --------------------------------------------------------------------------------------

TEST_F(RuntimeTest, OfARefusedSketchSetupRunsAndNoLoop) {
    bool ran = false;
    setup([] {});
    loop(1, 60ms, 100ms, 0, [&] { ran = true; });
    loop(2, 60ms, 100ms, 0, [&] { ran = true; });
    const Result<void> begun = begin();
    ASSERT_FALSE(begun);
    EXPECT_THAT(std::string(begun.error().message.view()), HasSubstr("test.ino:2"));
    EXPECT_THAT(std::string(runtime_->explanation().view()), HasSubstr("loop 2"));
    EXPECT_FALSE(ran);
}

TEST_F(RuntimeTest, InterruptsThatAreRoutedLaterAreAdmittedAgain) {
    SimConfig config;
    config.interrupts.push_back({.device = DeviceClass::nic,
                                 .rate_hz = 2000,
                                 .arrival = board::sim::Arrival::periodic,
                                 .core = 1,
                                 .top_half = 150us});
    Result<void> routed, without;
    loop(1, 80ms, 100ms, 0, [&] {
        routed = runtime_->route_interrupts(DeviceClass::nic, 1, false);  // to core 0
        without = runtime_->route_interrupts(DeviceClass::disk, 1, false);
        wait();
    });
    loop(2, 1ms, 100ms, 1, [&] { wait(); });
    ASSERT_TRUE(begin(config));
    run(150ms);
    ASSERT_FALSE(routed);
    EXPECT_THAT(std::string(routed.error().message.view()),
                HasSubstr("with these interrupts routed so, loop 1 on core 0"));
    EXPECT_EQ(board_->stolen_time(0), Nanoseconds{0}) << "the change was undone";
    EXPECT_TRUE(without);
}

TEST_F(RuntimeTest, OfARefusedChangeOnlyWhatItChangedIsUndone) {
    SimConfig config;
    const auto source = [](DeviceClass device, double rate_hz, Nanoseconds top_half) {
        return board::sim::InterruptSource{.device = device,
                                           .rate_hz = rate_hz,
                                           .arrival = board::sim::Arrival::periodic,
                                           .core = 1,
                                           .top_half = top_half};
    };
    config.interrupts = {source(DeviceClass::nic, 2000, 150us), source(DeviceClass::disk, 100, 10us)};
    Result<void> all, again;
    setup([&] { EXPECT_TRUE(runtime_->route_interrupts(DeviceClass::disk, 1, false)); });
    loop(1, 80ms, 100ms, 0, [&] {
        // Core 0 cannot bear the NIC's.
        all = runtime_->route_interrupts(DeviceClass::all, 1, false);
        wait();
        again = runtime_->route_interrupts(DeviceClass::disk, 1, false);
        wait();
    });
    loop(2, 1ms, 100ms, 1, [&] { wait(); });
    ASSERT_TRUE(begin(config));
    run(95ms);
    EXPECT_FALSE(all);
    EXPECT_EQ(board_->stolen_time(0), 9 * 10us) << "the disk's stay where setup() has sent them";
    run(150ms);
    EXPECT_TRUE(again) << "what is so already needs no admission";
}

TEST_F(RuntimeTest, WithoutEnforcementItRunsAllTheSame) {
    loop(1, 60ms, 100ms, 0, [this] { busy(60ms), wait(); });
    loop(2, 60ms, 100ms, 0, [this] { busy(60ms), wait(); });
    ASSERT_TRUE(begin({}, {.enforce_admission = false}));
    run(1s);
    EXPECT_EQ(statistics(1).overruns.get(), 0);
    EXPECT_GT(statistics(2).overruns.get(), 0);
}

TEST_F(RuntimeTest, SetupRunsOnceBeforeTheLoopsAndMayTakeTime) {
    std::vector<std::pair<int, Instant>> order;
    setup([&] {
        EXPECT_EQ(board_->current_vcpu(), board::kNoVcpu);
        wait();             // nothing to wait for
        runtime_->yield();  // 20 us
        board_->sleep_until(at(5ms));
        order.emplace_back(0, now());
    });
    loop(1, 1ms, 10ms, 0, [&] {
        order.emplace_back(1, now());
        wait();
    });
    ASSERT_TRUE(begin());
    run(20ms);
    EXPECT_EQ(order, (std::vector<std::pair<int, Instant>>{{0, at(5ms)}, {1, at(5ms)}, {1, at(15ms)}}));
}

TEST_F(RuntimeTest, RealTimePathsAllocateNothing) {
    std::size_t allocated = 0;
    const auto counted = [&](const Body& body) {
        return [&allocated, body] {
            const std::size_t before = allocation_count();
            body();
            allocated += allocation_count() - before;
        };
    };
    loop(1, 2ms, 10ms, 0, counted([&] {
             // Overruns.
             board_->compute(statistics(1).passes.get() % 7 == 0 ? Nanoseconds{13ms} : Nanoseconds{1ms});
             board_->pin_write(PinId{1}, Level::high);
             static_cast<void>(board_->pin_read(PinId{1}));
             static_cast<void>(board_->route_interrupts(DeviceClass::nic, 0, false));
             static_cast<void>(runtime_->interrupts_vcpu(DeviceClass::nic, 2ms, 100ms, kAnyCore));
             static_cast<void>(runtime_->interrupts_vcpu(DeviceClass::nic, 99ms, 100ms, kAnyCore));
             runtime_->global_interrupts(false);
             runtime_->global_interrupts(true);
             board_->pin_write(PinId{1}, Level::low);
             runtime_->yield();
             wait();
         }));
    loop(2, 100us, 100us, 1, counted([&] {
             board_->busy_until(now() + 3us);
             wait();
         }));
    setup([&] {
        EXPECT_TRUE(board_->pin_mode(PinId{1}, PinMode::output));
        EXPECT_TRUE(runtime_->attach_interrupt(PinId{1}, Edge::rising, &count_edge, 1ms, 10ms, 0));
        EXPECT_TRUE(runtime_->interrupts_vcpu(DeviceClass::nic, 1ms, 100ms, 0));
    });
    SimConfig config;
    config.interrupts.push_back(
        {.device = DeviceClass::nic, .rate_hz = 500, .top_half = 5us, .bottom_half = 20us});
    ASSERT_TRUE(begin(config));
    run(2ms);  // first touch
    allocated = 0;
    const std::size_t before = allocation_count();
    run(3s);
    EXPECT_EQ(allocated, 0u);
    EXPECT_EQ(allocation_count() - before, 0u);  // nor does the simulator itself
    EXPECT_GT(edges_, 50);
}

// ---- interrupts ---------------------------------------------------------------------------------

TEST_F(RuntimeTest, AHandlerRunsOnItsOwnIoVcpu) {
    static board::VcpuId seen;
    static SimBoard* handlers_board;
    seen = 0;
    setup([&] {
        handlers_board = board_.get();
        EXPECT_TRUE(board_->pin_mode(PinId{1}, PinMode::output));
        EXPECT_TRUE(runtime_->attach_interrupt(
            PinId{1}, Edge::rising, [] { seen = handlers_board->current_vcpu(); }, 1ms, 10ms, 1));
        EXPECT_TRUE(runtime_->attach_interrupt(PinId{2}, Edge::rising, &count_edge, Nanoseconds{0},
                                               Nanoseconds{0}, kAnyCore));
    });
    loop(1, 10ms, 100ms, 0, [&] {
        board_->pin_write(PinId{1}, Level::high);
        wait();
    });
    ASSERT_TRUE(begin());
    run(100ms);
    EXPECT_EQ(seen, 33);
    // Loop 1, its own I/O VCPU, and the default one.
    ASSERT_EQ(board_->guarantee().loops.size(), 3u);
    EXPECT_EQ(board_->guarantee().loops[1].core, 1);
}

TEST_F(RuntimeTest, HandlersAttachedWithoutABudgetShareTheGpioVcpu) {
    setup([&] {
        EXPECT_TRUE(runtime_->interrupts_vcpu(DeviceClass::gpio, 2ms, 20ms, 1));
        for (const std::uint16_t pin : {1, 2, 3}) {
            EXPECT_TRUE(runtime_->attach_interrupt(PinId{pin}, Edge::both, &count_edge, Nanoseconds{0},
                                                   Nanoseconds{0}, kAnyCore));
        }
    });
    loop(1, 10ms, 100ms, 0, [&] { wait(); });
    ASSERT_TRUE(begin());
    const auto report = board_->guarantee();
    ASSERT_EQ(report.loops.size(), 2u);
    EXPECT_EQ(report.loops[1].budget, Nanoseconds{2ms});
    EXPECT_EQ(report.loops[1].core, 1);
}

TEST_F(RuntimeTest, HeldInterruptsRunWhenTheyAreLetGo) {
    std::vector<int> edges_at;
    setup([&] {
        EXPECT_TRUE(board_->pin_mode(PinId{1}, PinMode::output));
        EXPECT_TRUE(runtime_->attach_interrupt(PinId{1}, Edge::rising, &count_edge, 1ms, 10ms, 1));
    });
    loop(1, 50ms, 100ms, 0, [&] {
        runtime_->global_interrupts(false);
        for (int i = 0; i < 3; ++i) {
            board_->pin_write(PinId{1}, Level::high);
            board_->pin_write(PinId{1}, Level::low);
            busy(1ms);
        }
        edges_at.push_back(edges_);
        runtime_->global_interrupts(true);
        busy(1ms);
        edges_at.push_back(edges_);
        board_->request_stop();
    });
    ASSERT_TRUE(begin());
    run(100ms);
    EXPECT_EQ(edges_at, (std::vector<int>{0, 3}));
}

TEST_F(RuntimeTest, WhileLoopsRunAPinTakesBackItsOwnHandlerAndNoOther) {
    static constexpr Nanoseconds kNone{0};
    const auto attach = [&](std::uint16_t pin, Edge edge, void (*handler)(), Nanoseconds budget) {
        return runtime_->attach_interrupt(PinId{pin}, edge, handler, budget, budget * 10, kAnyCore);
    };
    const auto pulse = [&](std::uint16_t pin) {
        board_->pin_write(PinId{pin}, Level::high);
        busy(1ms);
        board_->pin_write(PinId{pin}, Level::low);
        wait();
        return std::exchange(edges_, 0);
    };
    std::vector<int> seen;
    setup([&] {
        for (const std::uint16_t pin : {1, 2}) EXPECT_TRUE(board_->pin_mode(PinId{pin}, PinMode::output));
        EXPECT_TRUE(attach(1, Edge::rising, &count_edge, kNone));
        EXPECT_TRUE(attach(2, Edge::rising, &count_edge, 1ms));
        board_->detach_edge(PinId{2});
    });
    loop(1, 10ms, 100ms, 0, [&] {
        seen.push_back(pulse(1));
        board_->detach_edge(PinId{1});
        seen.push_back(pulse(1));
        EXPECT_TRUE(attach(1, Edge::rising, &count_edge, kNone));
        seen.push_back(pulse(1));
        EXPECT_TRUE(attach(1, Edge::both, &count_edge, kNone)) << "at other edges";
        seen.push_back(pulse(1));
        EXPECT_TRUE(attach(2, Edge::rising, &count_edge, 1ms)) << "on its own I/O VCPU";
        seen.push_back(pulse(2));
        const auto refused = [&](const Result<void>& answer) {
            return !answer && answer.error().code == ErrorCode::not_permitted;
        };
        EXPECT_TRUE(refused(attach(
            1, Edge::both, [] {}, kNone)))
            << "another handler";
        EXPECT_TRUE(refused(attach(3, Edge::both, &count_edge, kNone))) << "another pin";
        EXPECT_TRUE(refused(attach(1, Edge::both, &count_edge, 1ms))) << "another I/O VCPU";
        EXPECT_TRUE(refused(attach(2, Edge::both, &count_edge, kNone)));
        board_->request_stop();
    });
    ASSERT_TRUE(begin());
    run(1s);
    EXPECT_TRUE(board_->stopped());
    EXPECT_EQ(seen, (std::vector<int>{1, 0, 1, 2, 1}));
}

TEST_F(RuntimeTest, DeclaredTwiceInSetupTheLastCounts) {
    setup([&] {
        EXPECT_TRUE(runtime_->interrupts_vcpu(DeviceClass::nic, 50ms, 100ms, 1));
        EXPECT_TRUE(runtime_->interrupts_vcpu(DeviceClass::nic, 2ms, 20ms, 0));
    });
    loop(1, 60ms, 100ms, 0, [&] { wait(); });
    ASSERT_TRUE(begin());
    const auto report = board_->guarantee();
    ASSERT_EQ(report.loops.size(), 2u);
    EXPECT_EQ(report.loops[1].budget, Nanoseconds{2ms});
    EXPECT_EQ(report.loops[1].core, 0);
}

TEST_F(RuntimeTest, ABottomHalfsBudgetChangesWhileTheLoopsRunIfTheirCoreCanBearIt) {
    setup([&] { EXPECT_TRUE(runtime_->interrupts_vcpu(DeviceClass::nic, 10ms, 100ms, 0)); });
    loop(1, 60ms, 100ms, 0, [&] {
        EXPECT_TRUE(runtime_->interrupts_vcpu(DeviceClass::nic, 20ms, 100ms, kAnyCore));
        const auto refused = runtime_->interrupts_vcpu(DeviceClass::nic, 21ms, 100ms, 0);
        board_->request_stop();
        ASSERT_FALSE(refused);
        EXPECT_THAT(std::string(refused.error().message.view()),
                    HasSubstr("io 33 on core 0 would need 141 ms of its 100 ms"));
    });
    ASSERT_TRUE(begin());
    run(1s);
    EXPECT_TRUE(board_->stopped());
    EXPECT_EQ(board_->guarantee().loops[1].budget, Nanoseconds{20ms}) << "the refused one changed nothing";
}

TEST_F(RuntimeTest, WhatCannotChangeIsRefused) {
    setup([&] { EXPECT_TRUE(runtime_->interrupts_vcpu(DeviceClass::nic, 1ms, 100ms, 0)); });
    loop(1, 10ms, 100ms, 0, [&] {
        EXPECT_EQ(runtime_->interrupts_vcpu(DeviceClass::i2c, 1ms, 100ms, 0).error().code,
                  ErrorCode::not_found);
        EXPECT_EQ(runtime_->interrupts_vcpu(DeviceClass::nic, 1ms, 100ms, 1).error().code,
                  ErrorCode::not_permitted);
        board_->request_stop();
    });
    ASSERT_TRUE(begin());
    run(1s);
    EXPECT_TRUE(board_->stopped());
}

TEST_F(RuntimeTest, TheTickMayStopOnlyWhereALoopOwnsTheCore) {
    setup([&] {
        EXPECT_TRUE(runtime_->core_timer(1, false));
        EXPECT_EQ(runtime_->core_timer(0, false).error().code, ErrorCode::not_permitted);
        EXPECT_TRUE(runtime_->core_timer(0, true));
    });
    loop(1, 10ms, 100ms, 0, [&] { wait(); });
    loop(3, 10ms, 200ms, 0, [&] { wait(); });
    loop(2, 100us, 100us, 1, [&] { wait(); });
    SimConfig config;
    config.tick_period = 4ms;
    config.tick_cost = 1us;
    ASSERT_TRUE(begin(config));
    EXPECT_TRUE(board_->guarantee().cores[1].tick_stopped);
    EXPECT_FALSE(board_->guarantee().cores[0].tick_stopped);
}

/// The paper's stepper loop asks for a tenth of the core that it has to itself.
TEST_F(RuntimeTest, WithoutItsTimerACoreIsTheOneLoopsThatNamesIt) {
    std::vector<Nanoseconds> took;
    setup([&] {
        EXPECT_EQ(runtime_->core_timer(0, false).error().code, ErrorCode::not_permitted)
            << "loop 1 and a bottom half name it";
        EXPECT_TRUE(runtime_->interrupts_vcpu(DeviceClass::nic, 1ms, 100ms, 0));
        EXPECT_TRUE(runtime_->core_timer(1, false));
    });
    loop(1, 10ms, 100ms, 0, [&] { wait(); });
    loop(3, 10ms, 100ms, 0, [&] { wait(); });
    loop(2, 10us, 100us, 1, [&] {
        const Instant from = board_->now();
        busy(50us);
        took.push_back(board_->now() - from);
        if (took.size() == 3) board_->request_stop();
        wait();
    });
    ASSERT_TRUE(begin());
    EXPECT_TRUE(board_->guarantee().cores[1].tick_stopped);
    EXPECT_TRUE(guarantee_of(2).core_owned);
    run(1s);
    EXPECT_EQ(took, (std::vector<Nanoseconds>{50us, 50us, 50us})) << "nobody keeps its budget";
}

TEST_F(RuntimeTest, BottomHalvesGoWhereTheirInterruptsGo) {
    const auto core_of_the_bottom_half = [&](bool routed) {
        setup([&, routed] {
            EXPECT_TRUE(runtime_->interrupts_vcpu(DeviceClass::nic, 20ms, 100ms, kAnyCore));
            EXPECT_TRUE(runtime_->route_interrupts(DeviceClass::all, 1, !routed));
        });
        return begin(SimConfig{.cores = 3}) ? guarantee_of(board::kFirstIoVcpu).core : kAnyCore;
    };
    loop(1, 90ms, 100ms, 0, [&] { wait(); });
    loop(2, 10ms, 100ms, 1, [&] { wait(); });
    EXPECT_EQ(core_of_the_bottom_half(false), 1);
    EXPECT_EQ(core_of_the_bottom_half(true), 2);
}

TEST_F(RuntimeTest, TheInterruptsOfTheMachineCountInAdmission) {
    loop(1, 60ms, 100ms, 0, [&] { wait(); });
    SimConfig config;
    config.interrupts.push_back({.device = DeviceClass::nic,
                                 .rate_hz = 1000,
                                 .arrival = board::sim::Arrival::periodic,
                                 .top_half = 500us});
    EXPECT_FALSE(begin(config));  // half of the core is gone
}

}  // namespace
}  // namespace qduino::runtime::runtime_test
