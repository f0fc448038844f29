// TimerOne, MsTimer2 and TimerInterrupt on the simulator: functions that are called at their
// instants, on loops of their own.
#include <gtest/gtest.h>

#include <vector>

#define USE_TIMER_2 true
#include "arduino/Arduino.h"
#include "arduino/libraries/timers/ISR_Timer.h"
#include "arduino/libraries/timers/MsTimer2.h"
#include "arduino/libraries/timers/TimerInterrupt.h"
#include "arduino/libraries/timers/TimerOne.h"
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

/// `setup`, and a loop with the body `change`, for 400 ms.
void run(void (*setup)(), void (*change)()) {
    board::NoPeripherals nothing;
    board::sim::SimBoard board({}, nothing);
    runtime::Runtime runtime(board);
    runtime::SketchTable table = runtime::sketch_table();
    ASSERT_EQ(table.loops.size(), 3u) << "each timer declares its loop";
    table.setup = setup;
    ASSERT_TRUE(
        table.loops.try_push_back({{.id = 1, .budget = 10ms, .period = 100ms}, change, "test", 1, true}));
    const Result<void> begun = runtime.begin(table);
    ASSERT_TRUE(begun.ok()) << begun.error().message.view();
    runtime.run(kEpoch + 400ms);
    board.request_stop();
    runtime.run(board.now() + 1s);
}

TEST(ArduinoTimers, FunctionsAreCalledAtTheirInstants) {
    run(setup_timers, change_timers);

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

std::vector<std::pair<int, std::int64_t>> called;  // which, and when in ms

void note(int which) { called.push_back({which, (board::current().now() - kEpoch) / 1ms}); }
std::vector<std::int64_t> times_of(int which) {
    std::vector<std::int64_t> times;
    for (const auto& [one, at] : called)
        if (one == which) times.push_back(at);
    return times;
}
using Times = std::vector<std::int64_t>;

TEST(ArduinoTimers, ATimerEndsPausesAndGoesOn) {
    called.clear();
    static bool refused = false, short_refused = false;
    static long left = 0, for_ever = 0;
    run(
        [] {
            refused = !ITimer2.attachInterrupt(0, [] {});
            short_refused = !ITimer2.attachInterruptInterval(
                30, [] {}, 29);
            for_ever = ITimer2.getCount();
            ITimer2.attachInterruptInterval(
                30, +[](int which) { note(which); }, 7, 159);  // five fit in
        },
        [] {
            delay(70);
            ITimer2.pauseTimer();
            left = ITimer2.getCount();
            delay(50);
            ITimer2.resumeTimer();
            delay(1000);
        });
    EXPECT_TRUE(refused);
    EXPECT_TRUE(short_refused);
    EXPECT_EQ(for_ever, -1);
    EXPECT_EQ(left, 3);
    EXPECT_EQ(times_of(7), (Times{30, 60, 140, 170, 200}));
}

TEST(ArduinoTimers, SixteenAreMadeOfOne) {
    called.clear();
    static ISR_Timer timers;
    static int two = 2, last = 0, too_many = 0, none = 0;
    static unsigned used = 0;
    timers.init();
    run(
        [] {
            ITimer2.attachInterruptInterval(10, [] { timers.run(); });
            timers.setInterval(100, [] { note(0); });
            timers.setTimer(
                25, [] { note(1); }, 3);
            timers.setTimeout(
                40, +[](void* which) { note(*static_cast<int*>(which)); }, &two);
            timers.disable(timers.setInterval(10, [] { note(3); }));
            for (int i = 4; i < 16; ++i) last = timers.setTimeout(5000, [] { note(4); });
            too_many = timers.setTimeout(1, [] { note(5); });
            none = timers.setInterval(1, nullptr);
        },
        [] {
            delay(205);
            timers.changeInterval(0, 50);
            timers.deleteTimer(static_cast<unsigned>(last));
            used = timers.getNumTimers();
            delay(1000);
        });
    EXPECT_EQ(last, 15);
    EXPECT_EQ(too_many, -1);
    EXPECT_EQ(none, -1);
    EXPECT_EQ(used, 13u) << "two have ended, and one was deleted";
    EXPECT_EQ(times_of(0), (Times{100, 200, 260, 310, 360}));
    EXPECT_EQ(times_of(1), (Times{30, 50, 80})) << "25, 50 and 75 ms, looked at every 10";
    EXPECT_EQ(times_of(2), (Times{40}));
    EXPECT_TRUE(times_of(3).empty());
}

}  // namespace
}  // namespace timers_test
