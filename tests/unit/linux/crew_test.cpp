#include "board/linux/loop/crew.h"

#include <gtest/gtest.h>

namespace qduino::board::linux::crew_test {
namespace {

VcpuSpec spec_of(VcpuId id, Nanoseconds period, int core) {
    VcpuSpec spec;
    spec.id = id;
    spec.budget = 1ms;
    spec.period = period;
    spec.core = core;
    return spec;
}

std::vector<int> priorities(const std::vector<VcpuSpec>& all, const LinuxConfig& config) {
    std::vector<int> found;
    for (const VcpuSpec& spec : all) found.push_back(priority_of(spec, all, config));
    return found;
}

TEST(Priorities, AreRateMonotonicOverAllCores) {
    LinuxConfig config;
    EXPECT_EQ(priorities({spec_of(1, 100ms, 0), spec_of(2, 10ms, 0), spec_of(3, 50ms, 1)}, config),
              (std::vector<int>{78, 80, 79}));
}

/// The kernel runs threads of one priority in turns: a loop would wait for one that admission puts
/// below it.
TEST(Priorities, OfEqualPeriodsOnOneCoreDifferAndOnTwoCoresDoNot) {
    LinuxConfig config;
    EXPECT_EQ(priorities({spec_of(1, 40ms, 1), spec_of(2, 40ms, 1), spec_of(3, 40ms, 0), spec_of(4, 90ms, 0)},
                         config),
              (std::vector<int>{80, 79, 80, 78}));
}

TEST(Priorities, TheLastRanksShareTheLowest) {
    LinuxConfig config;
    config.priority_highest = 41;
    EXPECT_EQ(priorities({spec_of(1, 1ms, 0), spec_of(2, 2ms, 0), spec_of(3, 3ms, 0)}, config),
              (std::vector<int>{41, 40, 40}));
}

TEST(Priorities, OfMoreRanksThanThereAreEachCoreHasItsOwn) {
    LinuxConfig config;
    config.priority_highest = 41;
    EXPECT_EQ(
        priorities({spec_of(1, 1ms, 0), spec_of(2, 2ms, 0), spec_of(3, 3ms, 1), spec_of(4, 4ms, 1)}, config),
        (std::vector<int>{41, 40, 41, 40}));
}

/// Admission counts no bottom half before a loop of its client's period.
TEST(Priorities, ABottomHalfComesBehindTheLoopsOfItsClientsPeriod) {
    VcpuSpec io = spec_of(kFirstIoVcpu, 1ms, 0);
    io.kind = sched::VcpuKind::io;
    io.client_period = 10ms;
    EXPECT_EQ(priorities({io, spec_of(1, 90ms, 0), spec_of(2, 10ms, 0), spec_of(32, 10ms, 0)}, LinuxConfig{}),
              (std::vector<int>{78, 77, 80, 79}));
}

TEST(Priorities, NoneWithoutRealTime) {
    LinuxConfig config;
    config.real_time = false;
    EXPECT_EQ(priorities({spec_of(1, 1ms, 0)}, config), std::vector<int>{0});
}

}  // namespace
}  // namespace qduino::board::linux::crew_test
