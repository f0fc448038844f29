// Three loops of one core with real priorities: the high one waits for the low one's critical
// section, and not for the middle one, which would run for much longer. The order is looked at, no
// time. (tests/unit/board has the same on boards without priorities, tests/scenario/guarantee to
// the nanosecond in the simulator.)
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <functional>

#include "board/linux/kernel/real_time_thread.h"
#include "board/linux/linux_board.h"

namespace qduino::board::linux::test::lock_rank_test {
namespace {

using Body = std::function<void()>;

VcpuSpec spec_of(VcpuId id, Nanoseconds budget, Nanoseconds period, Body& body) {
    VcpuSpec spec;
    spec.id = id;
    spec.budget = budget;
    spec.period = period;
    spec.core = cpu_count() - 1;
    spec.entry = [](void* function) { (*static_cast<Body*>(function))(); };
    spec.context = &body;
    return spec;
}

TEST(LocksOfOneRealCore, HighGoesBeforeMidThoughLowHoldsItsLock) {
    if (cpu_count() < 2) GTEST_SKIP() << "needs a second core";
    LinuxConfig config;
    config.lock_memory = false;
    config.handle_signals = false;
    auto opened = LinuxBoard::open(config);
    ASSERT_TRUE(opened.ok());
    LinuxBoard& board = **opened;

    LockWord lock;
    std::atomic<bool> held{false}, wanted{false};
    std::atomic<int> order{0};
    int low_unlocked = 0, high_locked = 0, mid_done = 0;
    const auto wait_for = [&](const std::atomic<bool>& flag) {
        while (!flag) board.sleep_until(board.now() + 100us);
    };
    Body low = [&] {
        board.lock(lock);
        held = true;
        wait_for(wanted);
        board.busy_until(board.now() + 3ms);
        low_unlocked = ++order;
        board.unlock(lock);
    };
    Body mid = [&] {
        wait_for(wanted);
        board.busy_until(board.now() + 40ms);
        mid_done = ++order;
    };
    Body high = [&] {
        wait_for(held);
        wanted = true;
        board.lock(lock);
        high_locked = ++order;
        board.unlock(lock);
    };
    ASSERT_TRUE(board
                    .start(std::array{spec_of(1, 60ms, 300ms, low), spec_of(2, 60ms, 200ms, mid),
                                      spec_of(3, 20ms, 100ms, high)})
                    .ok());
    const GuaranteeReport report = board.guarantee();
    board.request_stop();  // which none of them asks for
    board.run(kForever);
    EXPECT_LT(low_unlocked, high_locked);
    EXPECT_GT(mid_done, 0);
    const bool real_time = std::all_of(report.loops.begin(), report.loops.end(),
                                       [](const LoopGuarantee& loop) { return loop.priority_enforced; });
    if (!real_time) GTEST_SKIP() << "needs SCHED_FIFO: " << report.loops[0].shortfall.view();
    EXPECT_LT(high_locked, mid_done);
}

}  // namespace
}  // namespace qduino::board::linux::test::lock_rank_test
