// port.h bound to a board: nothing before, everything after, nothing again.
#include "runtime/bind.h"

#include <gtest/gtest.h>

#include "board/sim/sim_board.h"

QDUINO_BIND_BOARD(board::sim::SimBoard);

namespace qduino {
namespace {

using board::Level;
using board::PinId;
using board::PinMode;

// A sketch's static objects may call the board before main().
const bool kHighBeforeMain = [] {
    port::pin_write(PinId{13}, Level::high);
    return port::pin_read(PinId{13}) == Level::high;
}();

TEST(Bind, WithoutABoardEveryCallIsHarmless) {
    EXPECT_FALSE(kHighBeforeMain);
    std::array<std::uint8_t, 2> bytes{};
    EXPECT_EQ(port::now(), kEpoch);
    port::busy_until(kForever);
    port::sleep_until(kForever);
    EXPECT_FALSE(port::pin_mode(PinId{1}, PinMode::output));
    port::pin_write(PinId{1}, Level::high);
    EXPECT_EQ(port::pin_read(PinId{1}), Level::low);
    EXPECT_FALSE(port::pwm_write(PinId{1}, 0.5));
    EXPECT_FALSE(port::pwm_period(PinId{1}, 20ms));
    EXPECT_FALSE(port::analog_read(PinId{1}));
    EXPECT_FALSE(port::i2c_transfer({1}, {0x48}, bytes, bytes));
    EXPECT_FALSE(port::spi_transfer({0}, {}, bytes));
    EXPECT_FALSE(port::safe_state(PinId{1}, Level::low));
    board::LockWord lock;
    port::lock(lock);
    EXPECT_TRUE(port::try_lock(lock));
    port::unlock(lock);
    EXPECT_EQ(port::current_vcpu(), board::kNoVcpu);
    port::wait_for_next_period();
    port::yield();
    port::set_overrun_policy(1, 0, nullptr);
    EXPECT_FALSE(port::interrupts_vcpu(0, 1ms, 10ms, 0));
    EXPECT_FALSE(port::attach_interrupt(
        PinId{1}, board::Edge::both, [] {}, 1ms, 10ms, 0));
    port::detach_interrupt(PinId{1});
    EXPECT_FALSE(port::route_interrupts(0, 0, false));
    EXPECT_FALSE(port::core_timer(0, false));
    port::global_interrupts(false);
    port::request_stop();
    EXPECT_FALSE(port::stop_requested());
}

std::vector<Instant> starts;

void body() {
    starts.push_back(port::now());
    port::busy_until(port::now() + 2ms);
    port::pin_write(PinId{5}, Level::high);
    EXPECT_EQ(port::pin_read(PinId{5}), Level::high);
    EXPECT_EQ(port::current_vcpu(), 1);
    if (starts.size() == 3) port::request_stop();
    port::wait_for_next_period();
}

TEST(Bind, ABoundProgramReachesItsBoard) {
    board::NoPeripherals wires;
    board::sim::SimBoard board({}, wires);
    runtime::Runtime runtime(board);
    port::bind(&runtime);
    runtime::SketchTable table;
    table.setup = [] { EXPECT_TRUE(port::pin_mode(PinId{5}, PinMode::output)); };
    table.loops.push_back({.id = 1, .budget = 5ms, .period = 10ms, .core = 0, .body = &body});
    ASSERT_TRUE(runtime.begin(table));
    runtime.run(kForever);
    port::bind(nullptr);
    EXPECT_EQ(starts, (std::vector<Instant>{kEpoch, kEpoch + 10ms, kEpoch + 20ms}));
    EXPECT_TRUE(board.stopped());
    EXPECT_EQ(port::now(), kEpoch);
}

TEST(Bind, TheSketchTableIsOneAndEmptyWithoutASketch) {
    EXPECT_EQ(&runtime::sketch_table(), &runtime::sketch_table());
    EXPECT_TRUE(runtime::sketch_table().loops.empty());
}

}  // namespace
}  // namespace qduino
