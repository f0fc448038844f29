// The board and the runtime of a program: none before, these after, none again.
#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "board/sim/sim_board.h"
#include "runtime/runtime.h"

namespace qduino::current_test {
namespace {

using board::Level;
using board::PinId;
using board::PinMode;
using runtime::Runtime;

// A sketch's static objects may call the board before main(): it remembers what was asked of pins.
const bool kHighBeforeMain = [] {
    static_cast<void>(board::current().pin_mode(PinId{13}, PinMode::output));
    board::current().pin_write(PinId{13}, Level::high);
    return board::current().pin_read(PinId{13}) == Level::high;
}();

TEST(CurrentBoard, WithoutABoardEveryCallIsHarmless) {
    board::Board& none = board::current();
    EXPECT_TRUE(kHighBeforeMain);
    EXPECT_EQ(Runtime::current(), nullptr);
    std::array<std::uint8_t, 2> bytes{};
    EXPECT_EQ(none.now(), kEpoch);
    none.busy_until(kForever);
    none.busy_for(1h);
    none.sleep_until(kForever);
    EXPECT_EQ(none.pin_read(PinId{1}), Level::low);
    EXPECT_FALSE(none.pwm_period(PinId{1}, 20ms));
    EXPECT_FALSE(none.analog_read(PinId{1}));
    EXPECT_FALSE(none.i2c_transfer({1}, {0x48}, bytes, bytes));
    EXPECT_FALSE(none.spi_transfer({0}, {}, bytes));
    EXPECT_FALSE(none.safe_state(PinId{1}, Level::low));
    board::LockWord lock;
    none.lock(lock);
    EXPECT_TRUE(none.try_lock(lock));
    none.unlock(lock);
    EXPECT_EQ(none.current_vcpu(), board::kNoVcpu);
    EXPECT_FALSE(none.attach_edge(
        PinId{1}, board::Edge::both, [](void*) {}, nullptr, 33));
    none.detach_edge(PinId{1});
    EXPECT_FALSE(none.route_interrupts(board::DeviceClass::gpio, 0, false));
    EXPECT_FALSE(none.start({}));
    none.run(kForever);
    none.request_stop();
    EXPECT_FALSE(none.stop_requested());
    EXPECT_EQ(none.pwm_period(PinId{1}, 20ms).error().code, ErrorCode::unavailable);
}

std::vector<Instant> starts;

void body() {
    board::Board& mine = board::current();
    starts.push_back(mine.now());
    mine.busy_until(mine.now() + 2ms);
    mine.pin_write(PinId{5}, Level::high);
    EXPECT_EQ(mine.pin_read(PinId{5}), Level::high);
    EXPECT_EQ(mine.current_vcpu(), 1);
    if (starts.size() == 3) mine.request_stop();
    Runtime::current()->wait_for_next_period();
}

TEST(CurrentBoard, ARuntimesBoardIsTheProgramsUntilItGoes) {
    board::NoPeripherals wires;
    board::sim::SimBoard board({}, wires);
    {
        Runtime runtime(board);
        EXPECT_EQ(&board::current(), &board);
        EXPECT_EQ(Runtime::current(), &runtime);
        runtime::SketchTable table;
        table.setup = [] { EXPECT_TRUE(board::current().pin_mode(PinId{5}, PinMode::output)); };
        table.loops.push_back({{.id = 1, .budget = 5ms, .period = 10ms, .core = 0}, &body});
        ASSERT_TRUE(runtime.begin(table));
        runtime.run(kForever);
    }
    EXPECT_EQ(starts, (std::vector<Instant>{kEpoch, kEpoch + 10ms, kEpoch + 20ms}));
    EXPECT_TRUE(board.stopped());
    EXPECT_NE(&board::current(), &board);
    EXPECT_EQ(Runtime::current(), nullptr);
}

TEST(CurrentBoard, TheRuntimeThatWasMadeLastStaysWhenAnEarlierOneGoes) {
    board::NoPeripherals wires;
    board::sim::SimBoard first({}, wires), second({}, wires);
    auto earlier = std::make_unique<Runtime>(first);
    const Runtime later(second);
    earlier.reset();
    EXPECT_EQ(&board::current(), &second);
    EXPECT_EQ(Runtime::current(), &later);
}

TEST(CurrentBoard, TheSketchTableIsOneAndEmptyWithoutASketch) {
    EXPECT_EQ(&runtime::sketch_table(), &runtime::sketch_table());
    EXPECT_TRUE(runtime::sketch_table().loops.empty());
}

}  // namespace
}  // namespace qduino::current_test
