// What control groups leave to a program: of real-time tasks, of ordinary ones, of cores. The
// kernel's files are a folder here.
#include "board/linux/kernel/control_groups.h"

#include <gtest/gtest.h>

#include "board/linux/computer/overheads.h"
#include "board/linux/kernel/real_time_thread.h"
#include "sched/admission.h"
#include "tests/unit/linux/fake_machine.h"

namespace qduino::board::linux::test::control_groups_test {
namespace {

constexpr const char* kCpu = "/sys/fs/cgroup/cpu";

/// Version 1; this process is in /house/room.
void furnish_v1(FakeMachine& machine) {
    machine.put("/proc/self/cgroup", "4:cpuset:/house\n3:cpu,cpuacct:/house/room\n0::/");
    machine.put("/proc/self/mountinfo",
                "32 25 0:28 / /sys/fs/cgroup/cpu rw - cgroup cgroup rw,cpu,cpuacct\n"
                "33 25 0:29 / /sys/fs/cgroup/cpuset rw - cgroup cgroup rw,cpuset");
    machine.put("/proc/sys/kernel/sched_rt_runtime_us", "950000");
    machine.put("/proc/sys/kernel/sched_rt_period_us", "1000000");
}

void put_share(FakeMachine& machine, const std::string& group, int runtime_us, int period_us = 1'000'000) {
    machine.put(kCpu + group + "/cpu.rt_runtime_us", std::to_string(runtime_us));
    machine.put(kCpu + group + "/cpu.rt_period_us", std::to_string(period_us));
}

TEST(ControlGroups, TheTightestShareOfRealTimeCounts) {
    FakeMachine machine;
    furnish_v1(machine);
    put_share(machine, "", 950'000);
    put_share(machine, "/house", 50'000);
    put_share(machine, "/house/room", 40'000, 500'000);
    put_share(machine, "/other", 0);
    const auto group = real_time_group(machine.root());
    ASSERT_TRUE(group);
    EXPECT_EQ(group->runtime, 50ms);
    EXPECT_EQ(group->period, 1s);
    EXPECT_EQ(group->file, machine.path("/sys/fs/cgroup/cpu/house/cpu.rt_runtime_us"));
}

TEST(ControlGroups, WithoutTheLimitOfTheComputerThereIsNoneOfAGroup) {
    FakeMachine machine;
    furnish_v1(machine);
    put_share(machine, "/house/room", 50'000);
    machine.put("/proc/sys/kernel/sched_rt_runtime_us", "-1");
    EXPECT_FALSE(real_time_group(machine.root()));
}

TEST(ControlGroups, AKernelWithoutSharesLimitsNothing) {
    FakeMachine machine;
    furnish_v1(machine);
    EXPECT_FALSE(real_time_group(machine.root()));
    EXPECT_FALSE(kept_waiting_by_quota(machine.root()));
    EXPECT_TRUE(cores_of_cpuset(machine.root()).empty());
}

/// A loop of 40 ms in 100 ms is alone on core 0.
bool is_admitted(const FakeMachine& machine) {
    sched::CoreLoad load;
    static_cast<void>(load.try_add({.id = 1, .budget = 40ms, .period = 100ms, .core = 0}));
    keep_for_ordinary_tasks(load.overheads, machine.root());
    return sched::admit(load).admitted;
}

TEST(ControlGroups, AdmissionCountsWhatAGroupLeaves) {
    FakeMachine machine;
    furnish_v1(machine);
    EXPECT_TRUE(is_admitted(machine));
    put_share(machine, "/house/room", 50'000);
    EXPECT_FALSE(is_admitted(machine)) << "50 ms of each second";
    sched::PlatformOverheads overheads;
    keep_for_ordinary_tasks(overheads, machine.root());
    EXPECT_EQ(overheads.kept_budget, 950ms);
    EXPECT_EQ(overheads.kept().name.view(), "control group's limit");
    put_share(machine, "/house/room", 950'000);
    EXPECT_TRUE(is_admitted(machine));
    put_share(machine, "/house/room", 0);
    EXPECT_TRUE(is_admitted(machine)) << "it takes no real-time task: the loop is an ordinary one";
}

TEST(ControlGroups, AQuotaIsSeenInBothVersions) {
    FakeMachine machine;
    furnish_v1(machine);
    machine.put("/sys/fs/cgroup/cpu/cpu.cfs_quota_us", "-1");
    machine.put("/sys/fs/cgroup/cpu/cpu.stat", "nr_periods 0\nnr_throttled 0\nthrottled_time 7");
    EXPECT_FALSE(kept_waiting_by_quota(machine.root()));
    machine.put("/sys/fs/cgroup/cpu/house/room/cpu.cfs_quota_us", "10000");
    machine.put("/sys/fs/cgroup/cpu/house/room/cpu.stat",
                "nr_periods 9\nnr_throttled 8\nthrottled_time 1500000000");
    EXPECT_EQ(kept_waiting_by_quota(machine.root()), 1500ms);
    EXPECT_EQ(cpu_quota(machine.root())->period, 100ms) << "the kernel's own";
    machine.put("/sys/fs/cgroup/cpu/house/cpu.stat", "throttled_time 0");
    machine.put("/sys/fs/cgroup/cpu/house/cpu.cfs_quota_us", "4000");
    machine.put("/sys/fs/cgroup/cpu/house/cpu.cfs_period_us", "50000");
    EXPECT_EQ(cpu_quota(machine.root())->runtime, 4ms) << "8 % is less than 10 %";
    EXPECT_TRUE(why_no_real_time(machine.root())
                    .view()
                    .starts_with("no SCHED_FIFO, and a quota of 4000 of 50000 us (cpu.cfs_quota_us): "));

    FakeMachine second;
    second.put("/proc/self/cgroup", "0::/box");
    second.put("/proc/self/mountinfo", "30 25 0:26 / /sys/fs/cgroup rw - cgroup2 cgroup2 rw");
    second.put("/sys/fs/cgroup/box/cpu.max", "max 100000");
    second.put("/sys/fs/cgroup/box/cpu.stat", "usage_usec 5\nnr_throttled 2\nthrottled_usec 30000");
    EXPECT_FALSE(kept_waiting_by_quota(second.root()));
    EXPECT_FALSE(cpu_quota(second.root()));
    second.put("/sys/fs/cgroup/box/cpu.max", "10000 100000");
    EXPECT_EQ(kept_waiting_by_quota(second.root()), 30ms);
    EXPECT_EQ(cpu_quota(second.root())->runtime, 10ms);
}

TEST(ControlGroups, ACpusetNamesItsCores) {
    FakeMachine machine;
    furnish_v1(machine);
    machine.put("/sys/fs/cgroup/cpuset/cpuset.cpus", "0-3");
    machine.put("/sys/fs/cgroup/cpuset/house/cpuset.cpus", "0,2");
    EXPECT_EQ(cores_of_cpuset(machine.root()).to_list(), "0,2");
}

}  // namespace
}  // namespace qduino::board::linux::test::control_groups_test
