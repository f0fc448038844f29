// How a loop's thread comes up, and what becomes of one that does not get its core.
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/prctl.h>

#include "board/linux/kernel/bare_spin.h"
#include "board/linux/loop/crew.h"

namespace qduino::board::linux::test::crew_start_test {
namespace {

VcpuSpec loop_on(int core, VcpuId id, void (*entry)(void*), void* context) {
    VcpuSpec spec;
    spec.id = id;
    spec.budget = 10ms;
    spec.period = 100ms;
    spec.core = core;
    spec.entry = entry;
    spec.context = context;
    return spec;
}

/// How many cores the calling thread may use.
int cores_of_caller() {
    cpu_set_t cores;
    CPU_ZERO(&cores);
    ::sched_getaffinity(0, sizeof cores, &cores);
    return CPU_COUNT(&cores);
}

TEST(CrewStart, AThreadThatDoesNotGetItsCoreEndsOnAnother) {
    if (cpu_count() < 2) GTEST_SKIP() << "it takes two cores";
    // It plays one that waits for core 0: it goes on when it has got another.
    std::atomic<bool> ran{false};
    EXPECT_FALSE(run_apart([&] {
        ASSERT_TRUE(pin_to_core(0));
        const Instant give_up = monotonic_now() + 20s;
        while (cores_of_caller() == 1 && monotonic_now() < give_up) block_until(monotonic_now() + 5ms);
        ran = cores_of_caller() > 1;
    }));
    if (cores_of_caller() == 1) GTEST_SKIP() << "somebody keeps all programs on one core";
    EXPECT_TRUE(ran);
    EXPECT_TRUE(run_apart([&] { ran = false; })) << "and one that gets it is awaited";
    EXPECT_FALSE(ran);
}

TEST(CrewStart, ALoopsThreadIsWokenAtItsAlarm) {
    ::prctl(PR_SET_TIMERSLACK, 300'000'000, 0, 0, 0);
    std::atomic<int> slack{0};
    Crew crew;
    const auto look = [](void* context) {
        *static_cast<std::atomic<int>*>(context) = ::prctl(PR_GET_TIMERSLACK, 0, 0, 0, 0);
    };
    ASSERT_TRUE(crew.add(loop_on(0, 1, look, &slack), {}));
    ASSERT_FALSE(crew.wait_until_ready(10s));
    crew.go();
    crew.request_stop();
    EXPECT_TRUE(crew.wait_until(monotonic_now() + 10s, [] {}));
    EXPECT_EQ(slack, 1) << "and not what this program was started with";
}

}  // namespace
}  // namespace qduino::board::linux::test::crew_start_test
