// TimerOne and MsTimer2 on the simulator: functions that are called at their instants, on loops of
// their own.
#include <gtest/gtest.h>

#include <vector>

#include "arduino/Arduino.h"
#include "arduino/MsTimer2.h"
#include "arduino/TimerOne.h"
#include "board/board.h"
#include "board/peripherals.h"
#include "board/sim/sim_board.h"
#include "runtime/runtime.h"

namespace timers_test {
namespace {

using namespace qduino;

std::vector<Instant> fast, slow;

void setup_timers() {
    Timer1.initialize(2'000);
    Timer1.attachInterrupt([] { fast.push_back(board::current().now()); });
    MsTimer2::set(30, [] { slow.push_back(board::current().now()); });
    MsTimer2::start();
}

/// From 100 ms on three times as slow, from 200 ms on silent.
void change_timers() {
    delay(100);
    Timer1.setPeriod(6'000);
    delay(100);
    Timer1.detachInterrupt();
    MsTimer2::stop();
    delay(1000);
}

TEST(ArduinoTimers, FunctionsAreCalledAtTheirInstants) {
    board::NoPeripherals nothing;
    board::sim::SimBoard board({}, nothing);
    runtime::Runtime runtime(board);
    runtime::SketchTable table = runtime::sketch_table();
    ASSERT_EQ(table.loops.size(), 2u) << "each timer declares its loop";
    table.setup = setup_timers;
    ASSERT_TRUE(table.loops.try_push_back(
        {{.id = 1, .budget = 10ms, .period = 100ms}, change_timers, "test", 1, true}));
    const Result<void> begun = runtime.begin(table);
    ASSERT_TRUE(begun.ok()) << begun.error().message.view();
    runtime.run(kEpoch + 400ms);
    board.request_stop();
    runtime.run(board.now() + 1s);

    const auto calls_before = [](const std::vector<Instant>& calls, Instant end) {
        return std::ranges::count_if(calls, [end](Instant at) { return at <= end; });
    };
    EXPECT_NEAR(static_cast<double>(calls_before(fast, kEpoch + 100ms)), 50, 1);
    EXPECT_NEAR(static_cast<double>(fast.size()), 50 + 16, 2);
    EXPECT_EQ(slow.size(), 6u);
    for (std::size_t i = 1; i < 40; ++i) EXPECT_EQ(fast[i] - fast[i - 1], 2ms) << i;
    for (std::size_t i = 1; i < slow.size(); ++i) EXPECT_EQ(slow[i] - slow[i - 1], 30ms) << i;
    EXPECT_LE(fast.back(), kEpoch + 201ms);
}

}  // namespace
}  // namespace timers_test
