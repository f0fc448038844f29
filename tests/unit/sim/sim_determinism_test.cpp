// The same seed gives the same run, to the last event, however the run is cut; another seed gives
// another.
#include <gtest/gtest.h>

#include <random>

#include "sim_fixture.h"

namespace qduino::board::sim::testing::sim_determinism_test {
namespace {

/// A machine with everything in it: three cores, shared and owned, interrupts both ways, an edge
/// handler, faults.
class Machine {
  public:
    explicit Machine(std::uint64_t seed, TraceSink* trace = nullptr) : board_(config(seed), wires_, trace) {
        const auto work = [this](Nanoseconds cost, Nanoseconds period) {
            return periodic_work(board_, cost, period);
        };
        program_.loop(1, 30ms, 100ms, 0, [this] { board_.busy_until(kForever); })
            .loop(2, 2ms, 8ms, 0, work(1500us, 8ms))
            .loop(3, 3ms, 11ms, 1, work(2ms, 11ms))
            .owning_loop(4, 100us, 2, [this] { pulses(); })
            .io(33, 1ms, 10ms, 1);
        EXPECT_TRUE(board_.pin_mode(PinId{5}, PinMode::output));
        EXPECT_TRUE(board_.attach_edge(
            PinId{5}, Edge::rising, [](void* self) { ++static_cast<Machine*>(self)->edges_; }, this, 33));
        EXPECT_TRUE(board_.serve_interrupts(DeviceClass::nic, 33));
        EXPECT_TRUE(board_.start(program_.specs()));
    }
    SimBoard& board() { return board_; }
    [[nodiscard]] std::uint64_t edges() const { return edges_; }

  private:
    static SimConfig config(std::uint64_t seed) {
        SimConfig config;
        config.cores = 3;
        config.seed = seed;
        config.tick_period = 4ms;
        config.tick_cost = 2us;
        config.costs.context_switch = 1500ns;
        config.interrupts.push_back({.device = DeviceClass::nic,
                                     .rate_hz = 800,
                                     .arrival = Arrival::poisson,
                                     .core = 0,
                                     .top_half = 5us,
                                     .bottom_half = 40us});
        config.interrupts.push_back({.device = DeviceClass::disk,
                                     .rate_hz = 300,
                                     .arrival = Arrival::poisson,
                                     .core = 1,
                                     .top_half = 4us,
                                     .bottom_half = 25us});
        config.loop_faults.push_back({.loop = 3, .from = at(300ms), .until = at(400ms), .extra = 1500us});
        return config;
    }
    void pulses() {
        for (Instant t = board_.now(); !board_.stop_requested(); t += 2500us) {
            board_.sleep_until(t);
            board_.pin_write(PinId{5}, Level::high);
            board_.busy_until(board_.now() + 3us);
            board_.pin_write(PinId{5}, Level::low);
        }
    }

    NoPeripherals wires_;
    SimBoard board_;
    Program program_;
    std::uint64_t edges_ = 0;
};

TEST(SimDeterminism, TheSameSeedGivesTheSameRun) {
    KeptTrace first_trace, second_trace;
    Machine first(7, &first_trace), second(7, &second_trace);
    first.board().run(at(1s));
    second.board().run(at(1s));
    EXPECT_EQ(first.board().trace_hash(), second.board().trace_hash());
    EXPECT_EQ(first.edges(), second.edges());
    EXPECT_GT(first.edges(), 300u);
    ASSERT_EQ(first_trace.events.size(), second_trace.events.size());
    EXPECT_GT(first_trace.events.size(), 3000u);
    for (std::size_t i = 0; i < first_trace.events.size(); ++i) {
        ASSERT_EQ(first_trace.events[i].time, second_trace.events[i].time);
        ASSERT_EQ(first_trace.events[i].vcpu, second_trace.events[i].vcpu);
        ASSERT_EQ(first_trace.events[i].kind, second_trace.events[i].kind);
    }
}

TEST(SimDeterminism, AnotherSeedGivesAnotherRun) {
    Machine first(7), second(8);
    first.board().run(at(1s));
    second.board().run(at(1s));
    EXPECT_NE(first.board().trace_hash(), second.board().trace_hash());
}

TEST(SimDeterminism, ATraceSinkDoesNotChangeTheRun) {
    KeptTrace trace;
    Machine first(7, &trace), second(7);
    first.board().run(at(1s));
    second.board().run(at(1s));
    EXPECT_EQ(first.board().trace_hash(), second.board().trace_hash());
}

TEST(SimDeterminism, ARunCutIntoPiecesIsTheSameRun) {
    Machine whole(7);
    whole.board().run(at(1s));
    for (const std::uint64_t seed : {1u, 2u, 3u}) {
        Machine cut(7);
        std::mt19937_64 random(seed);
        Instant t = at(0s);
        while (t < at(1s)) {
            t = std::min(t + Nanoseconds{static_cast<std::int64_t>(random() % 700'000)}, at(1s));
            cut.board().run(t);
            ASSERT_EQ(cut.board().now(), t);
        }
        EXPECT_EQ(cut.board().trace_hash(), whole.board().trace_hash()) << "cut by seed " << seed;
        EXPECT_EQ(cut.edges(), whole.edges());
        for (const VcpuId id : {1, 2, 3})
            EXPECT_EQ(cut.board().cpu_time(id), whole.board().cpu_time(id)) << int{id};
    }
}

TEST(SimDeterminism, RunsThatEndOnEventsAreTheSameRun) {
    Machine whole(7), cut(7);
    whole.board().run(at(200ms));
    // Ticks, releases and pulses lie there.
    for (Instant t = at(0s); t <= at(200ms); t += 500us) cut.board().run(t);
    EXPECT_EQ(cut.board().trace_hash(), whole.board().trace_hash());
}

TEST(SimDeterminism, TheHashSeesASinglePinWrite) {
    const auto hash_of = [](Level level, Nanoseconds when) {
        NoPeripherals wires;
        SimBoard board(SimConfig{}, wires);
        Program program;
        program.loop(1, 1ms, 10ms, 0, [&] {
            EXPECT_TRUE(board.pin_mode(PinId{1}, PinMode::output));
            board.busy_until(at(when));
            board.pin_write(PinId{1}, level);
        });
        EXPECT_TRUE(board.start(program.specs()));
        board.run(at(10ms));
        return board.trace_hash();
    };
    EXPECT_EQ(hash_of(Level::high, 10us), hash_of(Level::high, 10us));
    EXPECT_NE(hash_of(Level::high, 10us), hash_of(Level::low, 10us));
    EXPECT_NE(hash_of(Level::high, 10us), hash_of(Level::high, 10us + 1ns));
}

}  // namespace
}  // namespace qduino::board::sim::testing::sim_determinism_test
