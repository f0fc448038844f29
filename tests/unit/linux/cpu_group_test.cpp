// Control groups of both versions: where a group is made, what is written into it, and what is said
// where none can be made. The kernel's part is in tests/e2e/vcpu.
#include "board/linux/kernel/cpu_group.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "tests/unit/linux/fake_machine.h"

namespace qduino::board::linux::test::cpu_group_test {
namespace {

using ::testing::HasSubstr;

constexpr const char* kTop = "/sys/fs/cgroup";

/// A hierarchy of version 2; this process is in `own`.
void furnish_v2(FakeMachine& machine, const std::string& own) {
    machine.put("/proc/self/cgroup", "0::" + own);
    machine.put("/proc/self/mountinfo", "25 1 8:1 / / rw - ext4 /dev/sda1 rw\n30 25 0:26 / " +
                                            std::string{kTop} +
                                            " rw,nosuid shared:4 - cgroup2 cgroup2 rw,nsdelegate");
    std::string group = kTop;
    for (std::string_view rest = own;; rest = rest.substr(0, rest.rfind('/'))) {
        machine.put(group + std::string{rest} + "/cgroup.controllers", "cpuset cpu io memory");
        machine.put(group + std::string{rest} + "/cgroup.subtree_control", "memory");
        machine.put(group + std::string{rest} + "/cgroup.procs", "");
        if (rest.empty() || rest == "/") break;
    }
}

/// Hierarchies of version 1, cpu and cpuacct apart, beside an empty one of version 2.
void furnish_v1(FakeMachine& machine) {
    machine.put("/proc/self/cgroup", "4:cpuacct:/\n3:cpu:/box\n1:name=systemd:/\n0::/");
    machine.put("/proc/self/mountinfo",
                "31 25 0:27 / /sys/fs/cgroup/unified rw - cgroup2 cgroup2 rw\n"
                "32 25 0:28 /box /sys/fs/cgroup/cpu rw - cgroup cgroup rw,cpu\n"
                "33 25 0:29 / /sys/fs/cgroup/cpuacct rw - cgroup cgroup rw,cpuacct");
    machine.put("/sys/fs/cgroup/unified/cgroup.controllers", "");
    machine.put("/sys/fs/cgroup/unified/cgroup.subtree_control", "");
    machine.put("/sys/fs/cgroup/unified/cgroup.procs", "");
    machine.put("/sys/fs/cgroup/cpu/cgroup.procs", "");
    machine.put("/sys/fs/cgroup/cpu/cpu.stat", "nr_periods 0");
    machine.put("/sys/fs/cgroup/cpuacct/cgroup.procs", "");
}

TEST(CpuGroup, IsMadeAtTheTopOfVersion2AndTheControllerIsSwitchedOn) {
    FakeMachine machine;
    furnish_v2(machine, "/user.slice/shell.scope");
    const auto place = find_cpu_group_place(machine.root());
    ASSERT_TRUE(place) << place.error().message.view();
    EXPECT_TRUE(place->second_version);
    EXPECT_THAT(place->parents, ::testing::ElementsAre(machine.path(kTop)));
    EXPECT_EQ(machine.get(std::string{kTop} + "/cgroup.subtree_control"), "+cpu");
}

TEST(CpuGroup, IsMadeInVersion1WhereVersion2HasNoCpuController) {
    FakeMachine machine;
    furnish_v1(machine);
    const auto place = find_cpu_group_place(machine.root());
    ASSERT_TRUE(place) << place.error().message.view();
    EXPECT_FALSE(place->second_version);
    EXPECT_THAT(place->parents, ::testing::ElementsAre(machine.path("/sys/fs/cgroup/cpu"),
                                                       machine.path("/sys/fs/cgroup/cpuacct")))
        << "the mount shows the part of the hierarchy that begins with /box";
}

TEST(CpuGroup, SaysWhatToDoWhereThereIsNoController) {
    FakeMachine machine;
    machine.put("/proc/self/cgroup", "1:name=systemd:/");
    machine.put("/proc/self/mountinfo", "25 1 8:1 / / rw - ext4 /dev/sda1 rw");
    const auto none = find_cpu_group_place(machine.root());
    ASSERT_FALSE(none);
    EXPECT_EQ(none.error().code, ErrorCode::unsupported);
    EXPECT_THAT(std::string{none.error().message.view()}, HasSubstr("mount -t cgroup2"));
    EXPECT_LT(none.error().message.view().size(), decltype(Error::message)::kCapacity)
        << "nothing of it was cut";
}

TEST(CpuGroup, SaysWhatToDoWhereNoneMayBeMade) {
    FakeMachine machine;
    furnish_v2(machine, "/");
    machine.put(std::string{kTop} + "/cgroup.controllers", "memory");  // as in a container
    const auto none = find_cpu_group_place(machine.root());
    ASSERT_FALSE(none);
    EXPECT_EQ(none.error().code, ErrorCode::not_permitted);
    EXPECT_THAT(std::string{none.error().message.view()},
                HasSubstr(::geteuid() == 0 ? "writable /sys/fs/cgroup" : "systemd-run --user --scope"));
    EXPECT_LT(none.error().message.view().size(), decltype(Error::message)::kCapacity)
        << "nothing of it was cut";
}

TEST(CpuGroup, WritesTheBudgetInMicroseconds) {
    FakeMachine machine;
    furnish_v2(machine, "/");
    // What the kernel would make with the folder: here make() finds it, and says so.
    machine.put(std::string{kTop} + "/qduino-vcpu.1.0/cpu.max", "max 100000");
    CpuGroup group{{true, {machine.path(kTop)}}, "1.0"};
    const auto there = group.make(10ms, 100ms);
    ASSERT_FALSE(there);
    EXPECT_EQ(there.error().code, ErrorCode::already_exists);
    EXPECT_EQ(machine.get(std::string{kTop} + "/qduino-vcpu.1.0/cpu.max"), "max 100000") << "another's";
}

TEST(CpuGroup, ReadsTheUseOfBothVersions) {
    FakeMachine machine;
    machine.put("/two/qduino-vcpu.1.0/cpu.stat",
                "usage_usec 250\nuser_usec 200\nnr_periods 22\nnr_throttled 21\nthrottled_usec 99");
    const auto second = CpuGroup{{true, {machine.path("/two")}}, "1.0"}.use();
    ASSERT_TRUE(second);
    EXPECT_EQ(second->used, 250us);
    EXPECT_EQ(second->periods, 22);
    EXPECT_EQ(second->throttled, 21);
    EXPECT_EQ(second->throttled_for, 99us);
    machine.put("/one/qduino-vcpu.1.0/cpu.stat", "nr_periods 3\nnr_throttled 1\nthrottled_time 1234");
    machine.put("/one/qduino-vcpu.1.0/cpuacct.usage", "5000");
    const auto first = CpuGroup{{false, {machine.path("/one")}}, "1.0"}.use();
    ASSERT_TRUE(first);
    EXPECT_EQ(first->used, 5us);
    EXPECT_EQ(first->throttled_for, 1234ns);
    EXPECT_FALSE((CpuGroup{{true, {machine.path("/two")}}, "2.0"}.use()));
}

TEST(CpuGroup, RefusesBudgetsThatTheKernelDoesNotKeep) {
    EXPECT_TRUE(check_cpu_group_budget(1ms, 1s));
    EXPECT_TRUE(check_cpu_group_budget(100ms, 100ms));
    for (const auto& [budget, period] :
         {std::pair<Nanoseconds, Nanoseconds>{0ms, 100ms}, {101ms, 100ms}, {999us, 100ms}, {10ms, 1001ms}}) {
        const auto refused = check_cpu_group_budget(budget, period);
        ASSERT_FALSE(refused);
        EXPECT_EQ(refused.error().code, ErrorCode::invalid_argument);
    }
}

TEST(CpuGroup, RemovesItsOwnFoldersAlone) {
    FakeMachine machine;
    std::filesystem::create_directories(machine.path("/groups/qduino-vcpu.1.0"));
    std::filesystem::create_directories(machine.path("/groups/system.slice"));
    EXPECT_TRUE(remove_group({machine.path("/groups/qduino-vcpu.1.0")}, 0ms));
    EXPECT_FALSE(remove_group({machine.path("/groups/system.slice")}, 0ms));
    EXPECT_FALSE(std::filesystem::exists(machine.path("/groups/qduino-vcpu.1.0")));
    EXPECT_TRUE(std::filesystem::exists(machine.path("/groups/system.slice")));
}

}  // namespace
}  // namespace qduino::board::linux::test::cpu_group_test
