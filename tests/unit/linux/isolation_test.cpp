// Changes to the machine and their undoing: on a machine made of files, and, for root, on the real
// one.
#include "board/linux/computer/isolation.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>

#include <random>
#include <thread>

#include "board/linux/computer/core_probe.h"
#include "board/linux/kernel/core_times.h"
#include "board/linux/kernel/device_interrupts.h"
#include "board/linux/kernel/real_time_thread.h"
#include "posix/small_file.h"
#include "tests/unit/linux/fake_machine.h"
#include "tests/unit/linux/foreign_spinner.h"
#include "tests/unit/linux/host_snapshot.h"

namespace qduino::board::linux::test::isolation_test {

using posix::read_small_file;
using posix::write_small_file;
namespace {

HostSettings open_settings(const std::string& state) {
    auto opened = HostSettings::open(state);
    EXPECT_TRUE(opened.ok()) << opened.error().message.view();
    return opened ? std::move(*opened) : HostSettings{};
}

// ---- settings -----------------------------------------------------------------------------------

TEST(HostSettings, AreRecordedBeforeTheyAreChangedAndUndoneInReverse) {
    FakeMachine machine;
    machine.put("/a", "1");
    machine.put("/b", "x");
    {
        HostSettings settings = open_settings(machine.state());
        ASSERT_TRUE(settings.change(machine.path("/a"), "2").ok());
        ASSERT_TRUE(settings.change(machine.path("/a"), "3").ok());
        ASSERT_TRUE(settings.change(machine.path("/b"), "x").ok());  // as it is already
        EXPECT_EQ(machine.get("/a"), "3");
        const std::string recorded = machine.get("/run/settings.state");
        EXPECT_NE(recorded.find("write\t" + machine.path("/a") + "\t1"), std::string::npos);
        EXPECT_EQ(recorded.find(machine.path("/b")), std::string::npos);
    }
    EXPECT_EQ(machine.get("/a"), "1");
    EXPECT_EQ(machine.get("/run/settings.state"), "");
}

TEST(HostSettings, WhatCannotBeChangedIsAnErrorAndLeavesNoTrace) {
    FakeMachine machine;
    HostSettings settings = open_settings(machine.state());
    const std::string before = machine.get("/run/settings.state");
    EXPECT_EQ(settings.change(machine.path("/missing"), "1").error().code, ErrorCode::not_found);
    EXPECT_EQ(machine.get("/run/settings.state"), before);
}

TEST(HostSettings, BelongToOneLivingProcessAtATime) {
    FakeMachine machine;
    HostSettings settings = open_settings(machine.state());
    EXPECT_EQ(HostSettings::open(machine.state()).error().code, ErrorCode::unavailable);
    EXPECT_EQ(restore_settings(machine.state()).error().code, ErrorCode::unavailable);
    ASSERT_TRUE(settings.undo().ok());
    EXPECT_TRUE(HostSettings::open(machine.state()).ok());
}

TEST(HostSettings, ThoseOfADeadProcessAreUndoneByRestoreAndByTheNextStart) {
    for (const bool by_restore : {true, false}) {
        FakeMachine machine;
        machine.put("/a", "1");
        const pid_t child = ::fork();
        if (child == 0) {
            auto settings = HostSettings::open(machine.state());
            static_cast<void>(settings->change(machine.path("/a"), "2"));
            ::kill(::getpid(), SIGKILL);
        }
        ASSERT_EQ(::waitpid(child, nullptr, 0), child);
        ASSERT_EQ(machine.get("/a"), "2");
        if (by_restore) {
            const auto restored = restore_settings(machine.state());
            ASSERT_TRUE(restored.ok()) << restored.error().message.view();
            EXPECT_EQ(*restored, Restored::undone);
            EXPECT_EQ(*restore_settings(machine.state()), Restored::nothing_to_do);
        } else {
            const HostSettings next = open_settings(machine.state());
        }
        EXPECT_EQ(machine.get("/a"), "1");
    }
}

/// A state file of this boot with `lines`, as a dead process left it.
void write_state(const FakeMachine& machine, const std::string& lines) {
    const auto boot = read_small_file("/proc/sys/kernel/random/boot_id");
    ASSERT_TRUE(boot.ok());
    // The id ends in a newline.
    std::ofstream{machine.state()} << "qduino-settings 1 " << *boot << lines;
}

TEST(HostSettings, ALineCutShortByAKillIsIgnored) {
    FakeMachine machine;
    machine.put("/a", "1");
    machine.put("/b", "1");
    { HostSettings settings = open_settings(machine.state()); }
    write_state(machine, "write\t" + machine.path("/a") + "\t0\nwrite\t" + machine.path("/b") + "\t0");
    EXPECT_TRUE(restore_settings(machine.state()).ok());
    EXPECT_EQ(machine.get("/a"), "0");
    EXPECT_EQ(machine.get("/b"), "1");
}

// The kernel manages some interrupts itself (a disk's queues) and refuses every write of their
// cores. A kill between the record and the refused write leaves a record of a setting that never
// changed. osrelease is such a file for root too: readable, never writable.
TEST(HostSettings, ASettingThatNeverChangedIsNotWrittenAgain) {
    FakeMachine machine;
    { HostSettings settings = open_settings(machine.state()); }
    const char* const unwritable = "/proc/sys/kernel/osrelease";
    const auto value = read_small_file(unwritable);
    ASSERT_TRUE(value.ok());
    ASSERT_FALSE(write_small_file(unwritable, *value).ok());
    // It ends in a newline.
    write_state(machine, "write\t" + std::string{unwritable} + "\t" + *value);
    const auto restored = restore_settings(machine.state());
    ASSERT_TRUE(restored.ok()) << restored.error().message.view();
    EXPECT_EQ(*restored, Restored::undone);
}

TEST(HostSettings, OfAnEarlierBootAreForgotten) {
    FakeMachine machine;
    machine.put("/a", "1");
    { HostSettings settings = open_settings(machine.state()); }
    std::ofstream{machine.state()} << "qduino-settings 1 another-boot\nwrite\t" << machine.path("/a")
                                   << "\t0\n";
    EXPECT_TRUE(restore_settings(machine.state()).ok());
    EXPECT_EQ(machine.get("/a"), "1");
}

TEST(HostSettings, AKillAtAnyMomentLeavesAMachineThatRestorePutsBack) {
    const auto seed = static_cast<std::uint64_t>(std::random_device{}());
    std::mt19937_64 random{seed};
    SCOPED_TRACE("seed " + std::to_string(seed));
    FakeMachine machine;
    for (int i = 0; i < 40; ++i) machine.put("/setting" + std::to_string(i), "old");
    const auto before = machine.everything();
    for (int round = 0; round < 20; ++round) {
        const pid_t child = ::fork();
        if (child == 0) {
            for (;;) {
                auto settings = HostSettings::open(machine.state());
                for (int i = 0; i < 40; ++i) {
                    static_cast<void>(settings->change(machine.path("/setting" + std::to_string(i)), "new"));
                }
            }
        }
        std::this_thread::sleep_for(std::chrono::microseconds{500 + random() % 5000});
        ::kill(child, SIGKILL);
        ASSERT_EQ(::waitpid(child, nullptr, 0), child);
        ASSERT_TRUE(restore_settings(machine.state()).ok());
        // A write of a file that is no kernel setting may be cut between truncation and write; the
        // real ones are not.
        ASSERT_EQ(machine.everything(), before) << "round " << round;
    }
}

// ---- isolation ----------------------------------------------------------------------------------

IsolationOptions third_core_of(const FakeMachine& machine) {
    IsolationOptions options;
    options.cores = {3};
    options.cpus = 4;
    options.root = machine.root();
    return options;
}

TEST(Isolation, MovesEverythingThatCanBeMovedAndPutsItBack) {
    FakeMachine machine;
    machine.furnish();
    const auto before = machine.everything();
    {
        HostSettings settings = open_settings(machine.state());
        auto begun = Isolation::begin(settings, third_core_of(machine));
        ASSERT_TRUE(begun.ok());
        EXPECT_TRUE(begun->owns(3));
        EXPECT_FALSE(begun->owns(2));
        EXPECT_TRUE(begun->exclusive());
        EXPECT_TRUE(begun->throttling_lifted());
        EXPECT_EQ(machine.get("/proc/irq/default_smp_affinity"), "7");
        EXPECT_EQ(machine.get("/proc/irq/10/smp_affinity_list"), "0-2");
        // It had been on core 3 alone.
        EXPECT_EQ(machine.get("/proc/irq/11/smp_affinity_list"), "0-2");
        EXPECT_EQ(machine.get("/proc/irq/12/smp_affinity_list"), "0-1");
        EXPECT_EQ(machine.get("/sys/class/net/eth0/queues/rx-0/rps_cpus"), "7");
        EXPECT_EQ(machine.get("/sys/class/net/eth0/queues/tx-0/xps_cpus"), "7");
        EXPECT_EQ(machine.get("/sys/devices/virtual/workqueue/cpumask"), "7");
        EXPECT_EQ(machine.get("/proc/sys/kernel/sched_rt_runtime_us"), "-1");
        EXPECT_EQ(machine.get("/sys/devices/system/cpu/cpu3/cpufreq/scaling_governor"), "performance");
        EXPECT_EQ(machine.get("/sys/kernel/debug/sched/fair_server/cpu3/runtime"), "0");
        EXPECT_EQ(machine.get("/sys/fs/cgroup/cpuset/docker/cpuset.cpus"), "0-2");
        EXPECT_EQ(machine.get("/sys/fs/cgroup/cpuset/qduino-system/cpuset.cpus"), "0-2");
        EXPECT_EQ(machine.get("/sys/fs/cgroup/cpuset/qduino-core3/cpuset.cpus"), "3");
        EXPECT_EQ(machine.get("/sys/fs/cgroup/cpuset/qduino-core3/cpuset.cpu_exclusive"), "1");
        ASSERT_TRUE(begun->adopt(3, 1234).ok());
        EXPECT_EQ(machine.get("/sys/fs/cgroup/cpuset/qduino-core3/tasks"), "1234");
    }
    auto after = machine.everything();
    for (auto files : {&after}) {  // a folder of files stays where the kernel would remove a cgroup
        for (auto at = files->begin(); at != files->end();) {
            const bool by_the_kernel = at->first.find("/qduino-") != std::string::npos ||
                                       at->first == "/dev/cpu_dma_latency" ||
                                       at->first == "/sys/fs/cgroup/cpuset/tasks";
            at = by_the_kernel ? files->erase(at) : std::next(at);
        }
    }
    for (const auto& [file, text] : after) EXPECT_EQ(text, before.at(file)) << file;
}

TEST(Isolation, LiftsNoThrottlingWhileOthersMayRunOnTheCore) {
    FakeMachine machine;
    machine.furnish();
    std::filesystem::remove_all(machine.path("/sys/fs/cgroup"));
    HostSettings settings = open_settings(machine.state());
    const auto begun = Isolation::begin(settings, third_core_of(machine));
    ASSERT_TRUE(begun.ok());
    EXPECT_FALSE(begun->exclusive());
    EXPECT_FALSE(begun->throttling_lifted());
    EXPECT_EQ(machine.get("/proc/sys/kernel/sched_rt_runtime_us"), "950000");
    EXPECT_FALSE(begun->notes().empty());
}

TEST(Isolation, KeepsTheThreadsAliveThatServeAnInterruptWhichStays) {
    for (const bool has_fair_server : {true, false}) {
        FakeMachine machine;
        machine.furnish();
        machine.put("/proc/sys/kernel/osrelease", has_fair_server ? "6.12.30-rt-amd64" : "6.1.0-50-rt-amd64");
        machine.put("/sys/kernel/irq/10/actions", "virtio1-req.0");
        machine.put("/proc/irq/10/effective_affinity_list", "3");
        ::chmod(machine.path("/proc/irq/10/smp_affinity_list").c_str(), 0444);
        HostSettings settings = open_settings(machine.state());
        const auto begun = Isolation::begin(settings, third_core_of(machine));
        ASSERT_TRUE(begun.ok());
        EXPECT_EQ(machine.get("/proc/irq/10/smp_affinity_list"), "0-3");
        EXPECT_EQ(machine.get("/sys/kernel/debug/sched/fair_server/cpu3/runtime"), "50000000");
        EXPECT_EQ(begun->throttling_lifted(), has_fair_server);
        EXPECT_EQ(machine.get("/proc/sys/kernel/sched_rt_runtime_us"), has_fair_server ? "-1" : "950000");
        ASSERT_EQ(begun->notes().size(), 2u);
        EXPECT_EQ(
            begun->notes()[0],
            "interrupt 10 (virtio1-req.0) stays on the core: to let the kernel place it elsewhere, boot with "
            "isolcpus=managed_irq,3");
        EXPECT_EQ(begun->notes()[1], has_fair_server ? "fair server left on for its threads"
                                                     : "RT throttling left on for its threads");
    }
}

TEST(Isolation, AnInterruptThatGoesElsewhereAnywayIsNoTrouble) {
    FakeMachine machine;
    machine.furnish();
    machine.put("/proc/irq/10/effective_affinity_list", "0");
    ::chmod(machine.path("/proc/irq/10/smp_affinity_list").c_str(), 0444);
    HostSettings settings = open_settings(machine.state());
    const auto begun = Isolation::begin(settings, third_core_of(machine));
    ASSERT_TRUE(begun.ok());
    EXPECT_TRUE(begun->notes().empty());
    EXPECT_EQ(machine.get("/sys/kernel/debug/sched/fair_server/cpu3/runtime"), "0");
}

TEST(Isolation, UsesAPartitionWhereCgroupsAreOfTheSecondVersion) {
    FakeMachine machine;
    machine.furnish();
    std::filesystem::remove_all(machine.path("/sys/fs/cgroup"));
    machine.put("/sys/fs/cgroup/cgroup.controllers", "cpuset cpu io");
    machine.put("/sys/fs/cgroup/cgroup.subtree_control", "");
    machine.put("/sys/fs/cgroup/cgroup.procs", "");
    for (const char* file : {"cgroup.type", "cgroup.threads", "cpuset.cpus", "cpuset.cpus.partition"}) {
        machine.put(std::string{"/sys/fs/cgroup/qduino-core3/"} + file, "");
    }
    HostSettings settings = open_settings(machine.state());
    const auto begun = Isolation::begin(settings, third_core_of(machine));
    ASSERT_TRUE(begun.ok());
    EXPECT_TRUE(begun->exclusive());
    EXPECT_EQ(machine.get("/sys/fs/cgroup/cgroup.subtree_control"), "+cpuset");
    EXPECT_EQ(machine.get("/sys/fs/cgroup/qduino-core3/cgroup.type"), "threaded");
    EXPECT_EQ(machine.get("/sys/fs/cgroup/qduino-core3/cpuset.cpus.partition"), "isolated");
    ASSERT_TRUE(begun->adopt(3, 77).ok());
    EXPECT_EQ(machine.get("/sys/fs/cgroup/qduino-core3/cgroup.threads"), "77");
    EXPECT_EQ(machine.get("/sys/fs/cgroup/cgroup.procs"), std::to_string(::getpid()));
}

TEST(Isolation, LeavesTheRestOfTheMachineACore) {
    FakeMachine machine;
    machine.furnish();
    HostSettings settings = open_settings(machine.state());
    IsolationOptions options = third_core_of(machine);
    options.cores = {0, 1, 2, 3};
    EXPECT_EQ(Isolation::begin(settings, options).error().code, ErrorCode::out_of_range);
}

// ---- interrupts of a class ----------------------------------------------------------------------

TEST(DeviceInterrupts, AreFoundByDeviceAndByHandlerAndRouted) {
    FakeMachine machine;
    machine.put("/sys/devices/pci0/virtio2/x", "");
    std::filesystem::create_directories(machine.path("/sys/class/net/eth0"));
    std::filesystem::create_directory_symlink(machine.path("/sys/devices/pci0/virtio2"),
                                              machine.path("/sys/class/net/eth0/device"));
    machine.put("/sys/devices/pci0/msi_irqs/37", "msix");
    machine.put("/sys/kernel/irq/40/actions", "fe205000.I2C");
    machine.put("/sys/kernel/irq/41/actions", "virtio1-req.0");
    machine.put("/proc/irq/37/smp_affinity_list", "0-1");
    machine.put("/proc/irq/40/smp_affinity_list", "1");
    machine.put("/proc/irq/41/smp_affinity_list", "0-1");
    EXPECT_EQ(interrupts_of_class(DeviceClass::nic, machine.root()), std::set<int>{37});
    EXPECT_EQ(interrupts_of_class(DeviceClass::i2c, machine.root()), std::set<int>{40});
    EXPECT_EQ(interrupts_of_class(DeviceClass::spi, machine.root()), std::set<int>{});
    EXPECT_EQ(interrupts_of_class(DeviceClass::all, machine.root()), (std::set<int>{37, 40, 41}));

    HostSettings settings = open_settings(machine.state());
    int stuck = 0;
    EXPECT_EQ(route_class(settings, DeviceClass::nic, 1, 2, false, stuck, machine.root()), 1);
    EXPECT_EQ(machine.get("/proc/irq/37/smp_affinity_list"), "0");
    EXPECT_EQ(route_class(settings, DeviceClass::i2c, 1, 2, false, stuck, machine.root()), 1);
    EXPECT_EQ(machine.get("/proc/irq/40/smp_affinity_list"), "0");  // it lived on core 1 alone
    EXPECT_EQ(route_class(settings, DeviceClass::i2c, 1, 2, true, stuck, machine.root()), 1);
    EXPECT_EQ(machine.get("/proc/irq/40/smp_affinity_list"), "0-1");
    // There already.
    EXPECT_EQ(route_class(settings, DeviceClass::nic, 1, 2, false, stuck, machine.root()), 0);
    ASSERT_TRUE(settings.undo().ok());
    EXPECT_EQ(machine.get("/proc/irq/37/smp_affinity_list"), "0-1");
    EXPECT_EQ(machine.get("/proc/irq/40/smp_affinity_list"), "1");
}

TEST(DeviceInterrupts, FindTheKernelThreadsOfAClass) {
    FakeMachine machine;
    machine.put("/sys/kernel/irq/40/actions", "fe205000.i2c");
    machine.put("/proc/50/comm", "irq/40-fe205000");
    machine.put("/proc/51/comm", "irq/41-mmc0");
    machine.put("/proc/52/comm", "napi/eth0-3");
    machine.put("/proc/53/comm", "bash");
    const auto i2c = bottom_halves_of(DeviceClass::i2c, machine.root());
    ASSERT_EQ(i2c.size(), 1u);
    EXPECT_EQ(i2c[0].tid, 50);
    const auto nic = bottom_halves_of(DeviceClass::nic, machine.root());
    ASSERT_EQ(nic.size(), 1u);
    EXPECT_EQ(nic[0].name, "napi/eth0-3");
}

TEST(CoreProbe, CountsTheInterruptsOfOneCore) {
    FakeMachine machine;
    machine.put("/proc/interrupts",
                "           CPU0       CPU2\n 24:   1   20  IO-APIC   5-edge   name\nLOC: 300 4000 Local "
                "timer interrupts\nERR: 7");
    EXPECT_EQ(interrupts_of(0, machine.root()), 1u + 300u + 7u);
    EXPECT_EQ(interrupts_of(2, machine.root()), 4020u);
    const auto counts = interrupt_counts_of(0, machine.root());
    ASSERT_TRUE(counts);
    EXPECT_EQ(counts->ticks, 300u);
    EXPECT_EQ(counts->others, 1u + 7u);
    EXPECT_FALSE(interrupts_of(1, machine.root()));  // not online
    EXPECT_FALSE(interrupts_of(0, machine.root() + "/nowhere"));
    EXPECT_TRUE(tickless_cores(machine.root()).empty());
    machine.put("/sys/devices/system/cpu/nohz_full", "1-2");
    EXPECT_TRUE(tickless_cores(machine.root()).has(2));
}

// ---- the real machine ---------------------------------------------------------------------------

TEST(Isolation, OfTheRealMachineIsUndoneInOrderAndAfterAKillAtAnyMoment) {
    if (::geteuid() != 0 || cpu_count() < 2) GTEST_SKIP() << "needs root and two cores";
    // The place that all programs use, so that none of them is at work meanwhile.
    const std::string state = kDefaultSettingsState;
    {
        const auto mine = HostSettings::open(state);
        if (!mine.ok()) GTEST_SKIP() << mine.error().message.view();
    }
    IsolationOptions options;
    options.cores = {cpu_count() - 1};
    options.cpus = cpu_count();
    options.lift_throttling = false;
    const auto before = HostSnapshot::take();
    {
        HostSettings settings = open_settings(state);
        const auto begun = Isolation::begin(settings, options);
        ASSERT_TRUE(begun.ok()) << begun.error().message.view();
        if (begun->exclusive()) {
            EXPECT_NE(HostSnapshot::take().changes_since(before), "");
        }
    }
    EXPECT_EQ(HostSnapshot::take().changes_since(before), "");

    const auto seed = static_cast<std::uint64_t>(std::random_device{}());
    std::mt19937_64 random{seed};
    SCOPED_TRACE("seed " + std::to_string(seed));
    for (int round = 0; round < 4; ++round) {
        const pid_t child = ::fork();
        if (child == 0) {
            auto settings = HostSettings::open(state);
            if (!settings) ::_exit(1);
            const auto begun = Isolation::begin(*settings, options);
            ::pause();
        }
        std::this_thread::sleep_for(std::chrono::microseconds{random() % 30'000});
        ::kill(child, SIGKILL);
        ASSERT_EQ(::waitpid(child, nullptr, 0), child);
        const auto restored = restore_settings(state);
        ASSERT_TRUE(restored.ok()) << restored.error().message.view();
        EXPECT_EQ(HostSnapshot::take().changes_since(before), "");
    }
}

// The spinner's priority is below those of the computer's own threads, and it never spins for
// longer than a moment.
TEST(Isolation, ARealTimeTaskOfAnotherProcessCannotComeToTheOwnedCore) {
    if (::geteuid() != 0 || cpu_count() < 2) GTEST_SKIP() << "needs root and two cores";
    const int core = cpu_count() - 1;
    {
        const ForeignSpinner open_core{core, 3, 50ms};
        if (!open_core.spins()) GTEST_SKIP() << "no SCHED_FIFO here: error " << open_core.priority_error();
    }
    auto opened = HostSettings::open(kDefaultSettingsState);
    if (!opened.ok()) GTEST_SKIP() << opened.error().message.view();
    IsolationOptions options;
    options.cores = {core};
    options.cpus = cpu_count();
    options.lift_throttling = false;
    {
        HostSettings settings = std::move(*opened);
        const auto begun = Isolation::begin(settings, options);
        ASSERT_TRUE(begun.ok()) << begun.error().message.view();
        if (!begun->exclusive()) GTEST_SKIP() << "no cpusets here: " << begun->notes().front();
        const ForeignSpinner foreign{core, 3, 200ms};
        EXPECT_FALSE(foreign.spins());
        EXPECT_EQ(foreign.core_error(), EINVAL) << "sched_setaffinity(2) to a core outside its set";
    }
    const ForeignSpinner afterwards{core, 3, 50ms};
    EXPECT_TRUE(afterwards.spins()) << "all is put back: error " << afterwards.core_error();
}

}  // namespace
}  // namespace qduino::board::linux::test::isolation_test
