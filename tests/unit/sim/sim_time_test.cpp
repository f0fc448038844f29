// How virtual time passes: what costs, what is free, and that no way of waiting stands still.
#include <gtest/gtest.h>

#include "sim_fixture.h"

namespace qduino::board::sim::testing::sim_time_test {
namespace {

/// Runs `body` as the only loop, on a core of its own, to the end.
Instant run_alone(SimConfig config, const std::function<void(SimBoard&)>& body) {
    NoPeripherals wires;
    SimBoard board(std::move(config), wires);
    Program program;
    program.owning_loop(1, 100us, 0, [&] { body(board); });
    EXPECT_TRUE(board.start(program.specs()));
    board.run(at(100s));
    EXPECT_TRUE(board.stopped());
    return board.now();
}

TEST(SimTime, CallsAreFreeByDefault) {
    EXPECT_EQ(run_alone({},
                        [](SimBoard& board) {
                            EXPECT_TRUE(board.pin_mode(PinId{1}, PinMode::output));
                            for (int i = 0; i < 100; ++i) board.pin_write(PinId{1}, Level::high);
                            static_cast<void>(board.now());
                            static_cast<void>(board.pin_read(PinId{1}));
                        }),
              at(0s));
}

TEST(SimTime, EachCallTakesItsCost) {
    SimConfig config;
    config.costs[ApiCall::pin_write] = 40ns;
    config.costs[ApiCall::i2c] = 10us;
    config.costs.i2c_per_byte = 90us;
    Instant written = kEpoch;
    const Instant end = run_alone(config, [&](SimBoard& board) {
        EXPECT_TRUE(board.pin_mode(PinId{1}, PinMode::output));  // writes the pin once: 40 ns
        for (int i = 0; i < 10; ++i) board.pin_write(PinId{1}, Level::high);
        written = board.now();
        std::array<std::uint8_t, 2> in{};
        const std::array<std::uint8_t, 1> out{0x84};
        static_cast<void>(board.i2c_transfer(I2cBus{1}, I2cAddress{0x48}, out, in));
    });
    EXPECT_EQ(written, at(440ns));
    EXPECT_EQ(end, at(440ns + 10us + 4 * 90us));  // the address, one byte out, two in
}

TEST(SimTime, LocksTakeTheirCostToo) {
    SimConfig config;
    config.costs[ApiCall::lock] = 100ns;
    LockWord lock;
    EXPECT_EQ(run_alone(config,
                        [&](SimBoard& board) {
                            board.lock(lock);
                            EXPECT_FALSE(board.try_lock(lock));
                            board.unlock(lock);
                        }),
              at(300ns));
}

TEST(SimTime, ASleeperIsWokenLateByTheMachinesLatencyAndASpinIsNot) {
    SimConfig config;
    config.wake_latency = 14us;
    std::vector<Instant> passed;
    run_alone(config, [&](SimBoard& board) {
        board.sleep_until(at(1ms));
        passed.push_back(board.now());
        board.busy_until(at(2ms));
        passed.push_back(board.now());
        board.sleep_until(at(2ms));  // past: no sleep, no latency
        passed.push_back(board.now());
    });
    EXPECT_EQ(passed, (std::vector<Instant>{at(1014us), at(2ms), at(2ms)}));
}

TEST(SimTime, SpinningOnTheClockComesToAnEnd) {
    const Instant end = run_alone({}, [](SimBoard& board) {
        while (board.now() < at(1ms)) {
        }
    });
    EXPECT_GE(end, at(1ms));
    EXPECT_LT(end, at(1ms + 1us));
}

TEST(SimTime, SpinningOnAPinLetsTheOtherCoreWriteIt) {
    class Wire final : public ::qduino::board::NoPeripherals {
      public:
        void pin_written(Instant, PinId, Level level) override { level_ = level; }
        Level pin_level(Instant, PinId) override { return level_; }

      private:
        Level level_ = Level::low;
    } wire;
    SimBoard board(SimConfig{}, wire);
    Program program;
    Instant seen = kEpoch;
    program
        .loop(1, 50ms, 100ms, 0,
              [&] {
                  while (board.pin_read(PinId{2}) == Level::low) {
                  }
                  seen = board.now();
              })
        .loop(2, 50ms, 100ms, 1, [&] {
            EXPECT_TRUE(board.pin_mode(PinId{1}, PinMode::output));
            board.sleep_until(at(3ms));
            board.pin_write(PinId{1}, Level::high);
        });
    ASSERT_TRUE(board.start(program.specs()));
    board.run(at(1s));
    EXPECT_GE(seen, at(3ms));
    EXPECT_LT(seen, at(3ms + 10us));
}

TEST(SimTime, SetupMayWaitBeforeAnythingRuns) {
    NoPeripherals wires;
    SimBoard board(SimConfig{}, wires);
    board.sleep_until(at(5ms));
    board.busy_until(at(7ms));
    EXPECT_EQ(board.now(), at(7ms));
    while (board.now() < at(8ms)) {
    }
    Instant began = kEpoch;
    Program program;
    program.loop(1, 1ms, 10ms, 0, [&] { began = board.now(); });
    ASSERT_TRUE(board.start(program.specs()));
    const Instant started = board.now();
    board.run(at(20ms));
    EXPECT_EQ(began, started);
}

TEST(SimTime, ASleepingLoopTakesNoBudget) {
    NoPeripherals wires;
    SimBoard board(SimConfig{}, wires);
    Program program;
    program.loop(1, 1ms, 100ms, 0, [&] { board.sleep_until(at(50ms)); });
    ASSERT_TRUE(board.start(program.specs()));
    board.run(at(1s));
    EXPECT_TRUE(board.stopped());
    EXPECT_EQ(board.now(), at(50ms));
    EXPECT_EQ(board.cpu_time(1), Nanoseconds{0});
}

TEST(SimTime, ARunWithNothingLeftToDoReturns) {
    NoPeripherals wires;
    SimBoard board(SimConfig{}, wires);
    Program program;
    program.loop(1, 1ms, 100ms, 0, [&] { board.sleep_until(kForever); });
    ASSERT_TRUE(board.start(program.specs()));
    board.run(kForever);
    EXPECT_FALSE(board.stopped());
}

TEST(SimTime, APassWithoutTimeIsChargedAndOneWithTimeIsNot) {
    NoPeripherals wires;
    SimBoard board(SimConfig{}, wires);
    Program program;
    int passes = 0;
    program.owning_loop(1, 100us, 0, [&] {
        while (board.now() < at(1us)) {
            ++passes;
            board.note_body_end();
        }
        const Instant before = board.now();
        board.busy_until(before + 10us);
        board.note_body_end();
        EXPECT_EQ(board.now(), before + 10us);
    });
    ASSERT_TRUE(board.start(program.specs()));
    board.run(at(1ms));
    EXPECT_TRUE(board.stopped());
    EXPECT_EQ(passes, 11);  // the first is free, ten cost 100 ns each
}

TEST(SimTime, TimeThatNothingElseDisturbsPassesWithoutTheEventLoop) {
    NoPeripherals wires;
    SimBoard board(SimConfig{}, wires);
    Program program;
    std::uint64_t pulses = 0;
    program.loop(1, 5ms, 10ms, 0, periodic_work(board, 1ms, 10ms)).owning_loop(2, 100us, 1, [&] {
        EXPECT_TRUE(board.pin_mode(PinId{1}, PinMode::output));
        while (!board.stop_requested()) {
            board.pin_write(PinId{1}, Level::high);
            board.busy_until(board.now() + 1us);
            board.pin_write(PinId{1}, Level::low);
            board.sleep_until(board.now() + 9us);  // it owns its core: nobody would run meanwhile
            ++pulses;
        }
    });
    ASSERT_TRUE(board.start(program.specs()));
    board.run(at(1s));
    EXPECT_GE(pulses, 99'999u);
    // At each event of loop 1: two in a period, and its own resumption.
    EXPECT_LE(board.resumes(), 600u);
}

TEST(SimTime, SafeStatesMayBeForcedWhileALoopHangs) {
    class Lamp final : public ::qduino::board::NoPeripherals {
      public:
        void pin_written(Instant, PinId, Level now) override { level = now; }
        void pwm_written(Instant, PinId, double now) override { duty = now; }
        Level level = Level::low;
        double duty = 0;
    } lamp;
    SimBoard board(SimConfig{}, lamp);
    Program program;
    program.loop(1, 50ms, 100ms, 0, [&] {
        EXPECT_TRUE(board.pin_mode(PinId{1}, PinMode::output));
        EXPECT_TRUE(board.safe_state(PinId{1}, Level::low));
        EXPECT_TRUE(board.pwm_write(PinId{1}, 0.7));
        board.pin_write(PinId{1}, Level::high);
        board.busy_until(kForever);
    });
    ASSERT_TRUE(board.start(program.specs()));
    board.request_stop();
    board.run(at(1s));
    EXPECT_FALSE(board.stopped());
    EXPECT_EQ(lamp.level, Level::high);
    board.force_safe_states();
    EXPECT_EQ(lamp.level, Level::low);
    EXPECT_EQ(lamp.duty, 0.0);
}

}  // namespace
}  // namespace qduino::board::sim::testing::sim_time_test
