// The cycle clock against the kernel's. Where it cannot be used both are the same, and the tests
// say little.
#include "board/linux/kernel/cycle_clock.h"

#include <gtest/gtest.h>

#include <thread>
#include <vector>

namespace qduino::board::linux::cycle_clock_test {
namespace {

/// Wide: what is tested is that it is the same clock, not how well; a wrong anchor is off by much
/// more.
constexpr Nanoseconds kApart = 2us;

TEST(CycleClock, BeforeItIsStartedItIsTheKernels) {
    CycleClock clock;
    const Instant before = monotonic_now();
    const Instant now = clock.now();
    EXPECT_GE(now, before);
    EXPECT_LE(now, monotonic_now());
    clock.keep_fresh();
    EXPECT_FALSE(clock.started());
}

TEST(CycleClock, ShowsTheKernelsTimeForManyAnchors) {
    CycleClock clock;
    clock.start();
    const Instant end = monotonic_now() + 300ms;
    for (Instant before = monotonic_now(); before < end; before = monotonic_now()) {
        const Instant now = clock.now();
        const Instant after = monotonic_now();
        ASSERT_GE(now, before - kApart);
        ASSERT_LE(now, after + kApart);
    }
}

TEST(CycleClock, ShowsItAfterItWasNotAskedForLong) {
    CycleClock clock;
    clock.start();
    static_cast<void>(clock.now());
    for (const Nanoseconds pause : {Nanoseconds{5ms}, Nanoseconds{30ms}, Nanoseconds{150ms}}) {
        block_until(monotonic_now() + pause);
        const Instant before = monotonic_now();
        const Instant now = clock.soon();
        EXPECT_GE(now, before - kApart);
        EXPECT_LE(now, monotonic_now() + kApart);
    }
}

TEST(CycleClock, NeverRunsBackwardsWhileThreadsTakeTurnsAtItsAnchor) {
    CycleClock clock;
    clock.start();
    std::vector<std::thread> threads;
    std::atomic<int> backwards{0};
    for (int i = 0; i < 3; ++i) {
        threads.emplace_back([&] {
            const Instant end = monotonic_now() + 100ms;
            // A reader that finds the anchor being set reads the kernel's clock, which may differ
            // by the width of a reading.
            for (Instant last = clock.now(); last < end;) {
                const Instant now = clock.now();
                if (now < last - kApart) ++backwards;
                last = now;
                clock.keep_fresh();
            }
        });
    }
    for (auto& thread : threads) thread.join();
    EXPECT_EQ(backwards, 0);
}

}  // namespace
}  // namespace qduino::board::linux::cycle_clock_test
