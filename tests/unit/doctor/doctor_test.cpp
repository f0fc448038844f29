// The doctor, on machines that are folders: a good one, and the same with one thing wrong at a
// time.
#include "doctor/doctor.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <functional>
#include <nlohmann/json.hpp>
#include <ostream>
#include <sstream>

#include "doctor/finding.h"
#include "tests/unit/linux/fake_machine.h"

namespace qduino::apps::doctor_test {
namespace {

using board::linux::test::FakeMachine;
using Json = nlohmann::json;

constexpr const char* kState = "/run/qduino/settings.state";

struct Said {
    int result = -1;
    std::string text;
};

Said ask(const FakeMachine& machine, bool json) {
    char* text = nullptr;
    std::size_t size = 0;
    std::FILE* out = ::open_memstream(&text, &size);
    Said said;
    said.result = run_doctor({json, machine.root()}, out);
    std::fclose(out);
    said.text.assign(text, size);
    ::free(text);
    return said;
}

constexpr const char* kConfig =
    "CONFIG_HZ=250\nCONFIG_HIGH_RES_TIMERS=y\nCONFIG_CPUSETS=y\nCONFIG_NO_HZ_FULL=y\nCONFIG_RCU_NOCB_CPU=y\n"
    "CONFIG_GPIO_CDEV=y\nCONFIG_I2C_CHARDEV=m\nCONFIG_CPU_ISOLATION=y\nCONFIG_POSIX_TIMERS=y\n"
    "CONFIG_IRQ_TIME_ACCOUNTING=y\nCONFIG_SECCOMP_FILTER=y\nCONFIG_SECURITY_LANDLOCK=y\n"
    "CONFIG_PARAVIRT_TIME_ACCOUNTING=y\nCONFIG_PROC_CHILDREN=y\n";

/// The same without one option.
std::string config_without(const std::string& option) {
    std::string config = kConfig;
    const std::size_t at = config.find("CONFIG_" + option + "=");
    return config.erase(at, config.find('\n', at) + 1 - at);
}

/// A kernel with RT_GROUP_SCHED: this process is in a group with so many microseconds in a second.
void put_group(FakeMachine& m, const std::string& runtime_us) {
    m.put("/proc/self/cgroup", "1:cpu:/box");
    m.put("/proc/self/mountinfo", "32 25 0:28 / /sys/fs/cgroup/cpu rw - cgroup cgroup rw,cpu");
    m.put("/sys/fs/cgroup/cpu/cpu.rt_runtime_us", "950000");
    m.put("/sys/fs/cgroup/cpu/cpu.rt_period_us", "1000000");
    m.put("/sys/fs/cgroup/cpu/box/cpu.rt_runtime_us", runtime_us);
    m.put("/sys/fs/cgroup/cpu/box/cpu.rt_period_us", "1000000");
}

/// A PC with Debian's real-time kernel, booted for a loop on core 1, asked by root.
void furnish_well(FakeMachine& m) {
    m.put("/sys/class/dmi/id/product_name", "Test Board 4000");
    m.put("/sys/devices/system/cpu/online", "0-3");
    m.put("/sys/devices/system/cpu/isolated", "");
    m.put("/sys/devices/system/cpu/nohz_full", "1");
    m.put("/sys/devices/system/cpu/cpu1/topology/thread_siblings_list", "1");
    m.put("/sys/devices/system/cpu/cpu1/cpufreq/scaling_governor", "performance");
    m.put("/sys/devices/system/clocksource/clocksource0/current_clocksource", "tsc");
    m.put("/sys/devices/system/clocksource/clocksource0/available_clocksource", "tsc hpet acpi_pm");
    m.put("/sys/kernel/mm/transparent_hugepage/enabled", "always [madvise] never");
    m.put("/sys/kernel/debug/sched/fair_server/cpu1/runtime", "50000000");
    m.put("/sys/fs/cgroup/cgroup.controllers", "cpuset cpu io memory pids");
    m.put("/sys/kernel/irq/10/actions", "ahci");
    m.put("/proc/irq/10/smp_affinity_list", "0-3");
    m.put("/proc/irq/10/effective_affinity_list", "0");
    m.put("/proc/irq/default_smp_affinity", "f");
    m.put("/proc/sys/kernel/osrelease", "6.12.30-rt-amd64");
    m.put("/proc/sys/kernel/version", "#1 SMP PREEMPT_RT Debian 6.12.30-1");
    m.put("/proc/sys/kernel/arch", "x86_64");
    m.put("/proc/sys/kernel/sched_rt_runtime_us", "950000");
    m.put("/proc/cmdline", "root=/dev/sda1 nohz_full=1 quiet");
    m.put("/proc/timer_list", "cpu: 0\n  .resolution: 1 nsecs");
    m.put("/proc/cpuinfo", "processor : 0\nmodel name : Test CPU\nflags : fpu tsc");
    m.put("/proc/stat", "cpu 100 0 50 1000 0 0 0 0 0 0");
    m.put("/proc/swaps", "Filename Type Size Used Priority");
    m.put("/proc/77/comm", "bash");
    m.put("/proc/self/status", "Name: doctor\nCapEff:\t000001ffffffffff");
    m.put("/boot/config-6.12.30-rt-amd64", kConfig);
    m.put("/sys/kernel/security/lsm", "lockdown,capability,landlock,yama");
    m.put("/etc/default/grub", "GRUB_CMDLINE_LINUX=\"\"");
    m.put("/dev/gpiochip0", "");
}

TEST(Doctor, AGoodMachineNeedsNothing) {
    FakeMachine machine;
    furnish_well(machine);
    const Said said = ask(machine, false);
    EXPECT_EQ(said.result, 0) << said.text;
    EXPECT_NE(said.text.find("Test Board 4000, 4 cores"), std::string::npos);
    EXPECT_NE(said.text.find("\nVerdict: all 32 are as they should be.\n"), std::string::npos);
    EXPECT_EQ(said.text.find("fix"), std::string::npos);
}

TEST(Doctor, SaysTheSameInJson) {
    FakeMachine machine;
    furnish_well(machine);
    machine.put("/proc/78/comm", "irqbalance");
    const Said said = ask(machine, true);
    EXPECT_EQ(said.result, 1);
    const Json json = Json::parse(said.text);
    EXPECT_EQ(json.at("machine"), "Test Board 4000, 4 cores");
    EXPECT_EQ(json.at("kernel"), "6.12.30-rt-amd64");
    ASSERT_EQ(json.at("findings").size(), 32u);
    const Json& finding = *std::find_if(json["findings"].begin(), json["findings"].end(),
                                        [](const Json& f) { return f["id"] == "irqbalance"; });
    EXPECT_EQ(finding.at("state"), "could be better");
    EXPECT_EQ(finding.at("found"), "running");
    EXPECT_FALSE(finding.at("why").get<std::string>().empty());
    EXPECT_EQ(finding.at("fix"), "sudo systemctl disable --now irqbalance");
}

/// GRUB and a shell read the command line before Linux does: a dollar sign needs three backslashes.
TEST(Doctor, TellsHowToBootForACoreBesideLinux) {
    FakeMachine machine;
    furnish_well(machine);
    machine.put("/sys/devices/system/cpu/present", "0-3");
    const std::string said = ask(machine, true).text;
    const auto finding = [](const std::string& text) {
        const Json findings = Json::parse(text)["findings"];
        return *std::find_if(findings.begin(), findings.end(),
                             [](const Json& f) { return f["id"] == "beside"; });
    };
    const std::string fix = finding(said).at("fix");
    for (const char* piece : {R"( -e 's/^GRUB_CMDLINE_LINUX="/&memmap=184M\\\\\\$0x10000000 /')",
                              R"(&memmap=4K\\\\\\$0x90000 /')", "&iomem=relaxed /'",
                              "&no_ipi_broadcast=1 /' /etc/default/grub && sudo update-grub"})
        EXPECT_NE(fix.find(piece), std::string::npos) << fix;
    machine.put("/proc/cmdline", "memmap=184M$0x10000000 memmap=4K$0x90000 iomem=relaxed no_ipi_broadcast=1");
    EXPECT_EQ(finding(ask(machine, true).text).at("found"), "this computer was booted for it");
}

/// One thing wrong with a machine, and what is to be said of it. Nothing else may be blamed.
struct Case {
    const char* name;
    const char* id;
    const char* state;
    const char* found;  ///< a part of it
    const char* fix;    ///< a part of it
    std::function<void(FakeMachine&)> spoil;
};
void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

class OneThingWrong : public testing::TestWithParam<Case> {};

TEST_P(OneThingWrong, IsSaidWithItsFix) {
    FakeMachine machine;
    furnish_well(machine);
    GetParam().spoil(machine);
    const Said said = ask(machine, true);
    EXPECT_EQ(said.result, 1);
    std::string others;
    const Json json = Json::parse(said.text);
    bool seen = false;
    for (const Json& finding : json.at("findings")) {
        if (finding["id"] != GetParam().id) {
            if (finding["state"] != "ok") others += finding.dump();
            continue;
        }
        seen = true;
        EXPECT_EQ(finding["state"], GetParam().state);
        EXPECT_NE(finding["found"].get<std::string>().find(GetParam().found), std::string::npos) << finding;
        EXPECT_NE(finding["fix"].get<std::string>().find(GetParam().fix), std::string::npos) << finding;
    }
    EXPECT_TRUE(seen);
    EXPECT_EQ(others, "");
}

/// Two things are to be said then: that it is a virtual machine, and who pays for its host.
TEST(Doctor, SaysThatALoopIsChargedForWhatTheHostTakes) {
    FakeMachine machine;
    furnish_well(machine);
    machine.put("/proc/cpuinfo", "processor : 0\nmodel name : Test CPU\nflags : fpu tsc hypervisor");
    machine.put("/boot/config-6.12.30-rt-amd64", config_without("PARAVIRT_TIME_ACCOUNTING"));
    const Json json = Json::parse(ask(machine, true).text);
    for (const Json& finding : json.at("findings")) {
        if (finding["id"] != "charged_time") continue;
        EXPECT_EQ(finding["state"], "could be better");
        EXPECT_NE(finding["found"].get<std::string>().find("and for what the host takes"), std::string::npos);
        return;
    }
    FAIL() << json;
}

/// A case that writes one file.
Case with(const char* name, const char* id, const char* state, const char* found, const char* fix,
          const char* path, const std::string& text) {
    return {name, id, state, found, fix, [=](FakeMachine& m) { m.put(path, text); }};
}

constexpr const char* kBetter = "could be better";
constexpr const char* kMissing = "missing";
constexpr const char* kNobody = "Name: doctor\nCapEff:\t0000000000000000";

const Case kCases[] = {
    with("dynamic_kernel", "preempt_rt", kBetter, "PREEMPT_DYNAMIC", "apt install linux-image-rt-amd64",
         "/proc/sys/kernel/version", "#1 SMP PREEMPT_DYNAMIC Debian"),
    with("option_not_built", "kernel_options", kBetter, "HZ=100, built without CPUSETS", "built with these",
         "/boot/config-6.12.30-rt-amd64",
         "CONFIG_HZ=100\nCONFIG_HIGH_RES_TIMERS=y\n# CONFIG_CPUSETS is not set\nCONFIG_NO_HZ_FULL=y\n"
         "CONFIG_RCU_NOCB_CPU=y\nCONFIG_GPIO_CDEV=y\nCONFIG_I2C_CHARDEV=m\nCONFIG_CPU_ISOLATION=y\n"
         "CONFIG_POSIX_TIMERS=y\nCONFIG_IRQ_TIME_ACCOUNTING=y\nCONFIG_SECCOMP_FILTER=y\n"
         "CONFIG_SECURITY_LANDLOCK=y\nCONFIG_PROC_CHILDREN=y"),
    with("charged_interrupts", "charged_time", kBetter, "for its own work, and for interrupts",
         "CONFIG_IRQ_TIME_ACCOUNTING", "/boot/config-6.12.30-rt-amd64",
         config_without("IRQ_TIME_ACCOUNTING")),
    with("no_filter", "loop_limits", kMissing, "no filter of system calls", "CONFIG_SECCOMP_FILTER",
         "/boot/config-6.12.30-rt-amd64", config_without("SECCOMP_FILTER")),
    with("no_landlock", "loop_limits", kBetter, "no Landlock", "CONFIG_SECURITY_LANDLOCK",
         "/boot/config-6.12.30-rt-amd64", config_without("SECURITY_LANDLOCK")),
    with("landlock_off", "loop_limits", kBetter, "Landlock is off", "lsm=landlock,lockdown,yama",
         "/sys/kernel/security/lsm", "lockdown,yama"),
    with("no_children", "loop_limits", kBetter, "tells no children", "CONFIG_PROC_CHILDREN",
         "/boot/config-6.12.30-rt-amd64", config_without("PROC_CHILDREN")),
    with("coarse_timers", "timer_resolution", kMissing, "timers resolve 4 ms", "linux-image-rt-amd64",
         "/proc/timer_list", "  .resolution: 4000000 nsecs"),
    with("slow_clock", "clocksource", kBetter, "hpet, though tsc is there",
         "echo tsc | sudo tee /sys/devices/system/clocksource/clocksource0/current_clocksource",
         "/sys/devices/system/clocksource/clocksource0/current_clocksource", "hpet"),
    {"slow_clock_only", "clocksource", kBetter, "acpi_pm", "tsc=reliable",
     [](FakeMachine& m) {
         m.put("/sys/devices/system/clocksource/clocksource0/current_clocksource", "acpi_pm");
         m.put("/sys/devices/system/clocksource/clocksource0/available_clocksource", "hpet acpi_pm");
     }},
    with("one_core", "cores", kMissing, "1 core", "two cores", "/sys/devices/system/cpu/online", "0"),
    with("no_cpuset_controller", "cpusets", kMissing, "without its cpuset controller",
         "mount -t cgroup -o cpuset", "/sys/fs/cgroup/cgroup.controllers", "cpu io memory"),
    {"nothing_mounted_but_isolcpus", "cpusets", kBetter, "isolcpus=1", "mount -t cgroup2",
     [](FakeMachine& m) {
         ::unlink(m.path("/sys/fs/cgroup/cgroup.controllers").c_str());
         m.put("/sys/devices/system/cpu/isolated", "1");
     }},
    {"ticks", "nohz_full", kBetter, "no core's tick stops", "&nohz_full=1 /' /etc/default/grub",
     [](FakeMachine& m) {
         m.put("/sys/devices/system/cpu/nohz_full", "(null)");
         m.put("/proc/cmdline", "quiet rcu_nocbs=1-3");
     }},
    {"rcu_callbacks", "rcu_nocbs", kBetter, "RCU callbacks", "&rcu_nocbs=1 /'",
     [](FakeMachine& m) { m.put("/proc/cmdline", "quiet rcu_nocbs=2-3"); }},
    with("hyper_threads", "smt", kBetter, "cores 1,3 share", "smt/control",
         "/sys/devices/system/cpu/cpu1/topology/thread_siblings_list", "1,3"),
    with("slow_governor", "governor", kBetter, "ondemand", "echo performance | sudo tee",
         "/sys/devices/system/cpu/cpu1/cpufreq/scaling_governor", "ondemand"),
    with("throttling_lifted", "rt_throttling", kBetter, "lifted for good",
         "sysctl kernel.sched_rt_runtime_us=950000", "/proc/sys/kernel/sched_rt_runtime_us", "-1"),
    with("never_real_time", "rt_throttling", kMissing, "never run", "950000",
         "/proc/sys/kernel/sched_rt_runtime_us", "0"),
    {"no_debugfs", "fair_server", kBetter, "debugfs", "mount -t debugfs",
     [](FakeMachine& m) { std::filesystem::remove_all(m.path("/sys/kernel/debug")); }},
    with("interrupt_here", "irq_affinity", kBetter, "1 on core 1: 10 (ahci)", "&irqaffinity=0,2-3 /'",
         "/proc/irq/10/effective_affinity_list", "1"),
    with("irqbalance", "irqbalance", kBetter, "running", "disable --now irqbalance", "/proc/900/comm",
         "irqbalance"),
    with("virtual", "hypervisor", kBetter, "virtual machine", "vcpupin", "/proc/cpuinfo",
         "processor : 0\nflags : fpu hypervisor tsc"),
    with("huge_pages", "huge_pages", kBetter, "[always]", "echo madvise | sudo tee",
         "/sys/kernel/mm/transparent_hugepage/enabled", "[always] madvise never"),
    with("swap", "swap", kBetter, "/dev/sda2", "swapoff -a", "/proc/swaps",
         "Filename Type Size Used Priority\n/dev/sda2 partition 100 0 -2"),
    with("dead_run", "leftovers", kBetter, "2 changes", "sudo qduino restore", kState,
         "qduino-settings 1 abc\nwrite\t/proc/irq/10/smp_affinity_list\t0-3\ngroup\t/sys/fs/cgroup/x"),
    {"no_priority", "rt_priority", kMissing, "RLIMIT_RTPRIO is 0", "rtprio 90",
     [](FakeMachine& m) {  // everything but CAP_SYS_NICE (23)
         m.put("/proc/self/status", "CapEff:\t000001ffff7fffff");
         m.put("/proc/self/limits", "Max realtime priority     0                    0");
     }},
    {"low_priority", "rt_priority", kBetter, "RLIMIT_RTPRIO is 50", "rtprio 90",
     [](FakeMachine& m) {
         m.put("/proc/self/status", "CapEff:\t000001ffff7fffff");
         m.put("/proc/self/limits", "Max realtime priority     50                   50");
     }},
    {"no_real_time_group", "rt_group", kMissing, "cpu.rt_runtime_us is 0", "cpu-rt-runtime",
     [](FakeMachine& m) { put_group(m, "0"); }},
    {"small_real_time_group", "rt_group", kBetter, "50 ms in 1 s", "sudo tee",
     [](FakeMachine& m) { put_group(m, "50000"); }},
    {"short_real_time", "rt_limit", kBetter, "RLIMIT_RTTIME is 200 ms", "rttime=unlimited",
     [](FakeMachine& m) {  // everything but CAP_SYS_RESOURCE (24)
         m.put("/proc/self/status", "CapEff:\t000001fffeffffff");
         m.put("/proc/self/limits",
               "Max locked memory    unlimited  unlimited  bytes\nMax realtime timeout 200000 200000 us");
     }},
    {"little_memory", "locked_memory", kMissing, "8192 KiB", "memlock unlimited",
     [](FakeMachine& m) {  // everything but CAP_IPC_LOCK (14)
         m.put("/proc/self/status", "CapEff:\t000001ffffffbfff");
         m.put("/proc/self/limits",
               "Max locked memory         8388608              8388608              bytes");
     }},
    {"not_root", "isolation_rights", kBetter, "not root", "sudo",
     [](FakeMachine& m) {
         m.put("/proc/self/status", kNobody);
         m.put("/proc/self/limits",
               "Max locked memory    unlimited  unlimited  bytes\nMax realtime priority 90 90");
     }},
};
INSTANTIATE_TEST_SUITE_P(Doctor, OneThingWrong, testing::ValuesIn(kCases),
                         [](const auto& one) { return std::string{one.param.name}; });

Json finding_of(const FakeMachine& machine, const std::string& id) {
    const Json json = Json::parse(ask(machine, true).text);
    for (const Json& finding : json.at("findings")) {
        if (finding["id"] == id) return finding;
    }
    ADD_FAILURE() << "no finding " << id;
    return {};
}

TEST(Doctor, CountsWhatIsWrong) {
    FakeMachine machine;
    furnish_well(machine);
    machine.put("/proc/900/comm", "irqbalance");
    EXPECT_NE(ask(machine, false).text.find("\nVerdict: 1 of 32 could be better.\n"), std::string::npos);
    machine.put("/proc/sys/kernel/sched_rt_runtime_us", "0");
    EXPECT_NE(ask(machine, false).text.find("\nVerdict: 1 of 32 could be better, 1 is missing.\n"),
              std::string::npos);
    machine.put("/proc/900/comm", "bash");
    EXPECT_NE(ask(machine, false).text.find("\nVerdict: 1 of 32 is missing.\n"), std::string::npos);
}

TEST(Doctor, BeginsWithWhatABeginnerMustDo) {
    FakeMachine machine;
    furnish_well(machine);
    const auto begins = [&](const std::string& words) {
        const std::string said = ask(machine, false).text;
        EXPECT_TRUE(said.starts_with(words)) << said.substr(0, 300);
    };
    begins("You can run sketches, in real time as well.\n\nComputer: ");
    machine.put("/proc/900/comm", "irqbalance");
    begins("You can run sketches, in real time as well. What could be better is told below\n(1); nothing ");
    machine.put("/proc/sys/kernel/sched_rt_runtime_us", "0");
    begins("You can run sketches. For real time do this:\n  1  ");
    put_group(machine, "0");
    begins("You can run sketches. For real time do these 2:\n  1  ");
    const std::string said = ask(machine, false).text;
    EXPECT_EQ(said.find("\n  3  "), std::string::npos);
    EXPECT_LT(said.find("\n  2  "), said.find("\nComputer: "));
}

TEST(Doctor, NeverPasses80Columns) {
    FakeMachine machine;  // nothing in it but many interrupts with long names
    machine.put("/sys/devices/system/cpu/online", "0-1");
    machine.put("/etc/default/grub", "");
    for (int irq = 10; irq < 30; ++irq) {
        machine.put("/proc/irq/" + std::to_string(irq) + "/smp_affinity_list", "0-1");
        machine.put("/sys/kernel/irq/" + std::to_string(irq) + "/actions", "0000:00:1f.6-a-rather-long-name");
    }
    const Said said = ask(machine, false);
    EXPECT_EQ(said.result, 1);
    std::istringstream words{said.text};
    std::string flat;
    for (std::string word; words >> word;) flat += word + ' ';
    EXPECT_NE(flat.find("and 15 more"), std::string::npos);
    std::istringstream lines{said.text};
    for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 80u) << line;
}

TEST(Doctor, AnInterruptThatItsDriverKeepsIsToldFromOnesThatCanBeMoved) {
    FakeMachine machine;
    furnish_well(machine);
    machine.put("/proc/irq/10/effective_affinity_list", "1");
    ::chmod(machine.path("/proc/irq/10/smp_affinity_list").c_str(), 0444);
    const Json finding = finding_of(machine, "irq_affinity");
    EXPECT_EQ(finding["state"], "ok");
    EXPECT_EQ(finding["found"], "no movable interrupt on core 1");
    const Json managed = finding_of(machine, "managed_irqs");
    EXPECT_EQ(managed["state"], kBetter);
    EXPECT_EQ(managed["found"], "10 (ahci) on core 1");
    EXPECT_NE(managed["fix"].get<std::string>().find("isolcpus=managed_irq,1"), std::string::npos);
    machine.put("/proc/cmdline", "isolcpus=1 quiet");
    EXPECT_NE(
        finding_of(machine, "managed_irqs")["fix"].get<std::string>().find("isolcpus=managed_irq,domain,1"),
        std::string::npos);
}

TEST(Doctor, ACoresOwnQueueOfADiskIsNotBlamed) {
    FakeMachine machine;
    furnish_well(machine);
    machine.put("/proc/irq/10/smp_affinity_list", "1");
    machine.put("/proc/irq/10/effective_affinity_list", "1");
    ::chmod(machine.path("/proc/irq/10/smp_affinity_list").c_str(), 0444);
    EXPECT_EQ(finding_of(machine, "managed_irqs")["found"], "none on core 1");
}

TEST(Doctor, TheCoreThatWasSetApartAtBootIsTheOneJudged) {
    FakeMachine machine;
    furnish_well(machine);
    machine.put("/sys/devices/system/cpu/isolated", "3");
    machine.put("/proc/irq/10/effective_affinity_list", "3");
    EXPECT_EQ(finding_of(machine, "irq_affinity")["found"], "1 on core 3: 10 (ahci)");
    EXPECT_EQ(finding_of(machine, "nohz_full")["state"], kBetter);
}

TEST(Doctor, ARunThatLivesIsNoLeftover) {
    FakeMachine machine;
    furnish_well(machine);
    machine.put(kState, "qduino-settings 1 abc\nwrite\t/x\t1");
    const int file = ::open(machine.path(kState).c_str(), O_RDWR);
    ASSERT_EQ(::flock(file, LOCK_EX), 0);
    EXPECT_EQ(finding_of(machine, "leftovers")["state"], "ok");
    ::close(file);
    EXPECT_EQ(finding_of(machine, "leftovers")["state"], kBetter);
}

TEST(Doctor, KnowsARaspberryPi) {
    FakeMachine machine;
    furnish_well(machine);
    machine.put("/proc/device-tree/model", std::string("Raspberry Pi 4 Model B Rev 1.5") + '\0');
    machine.put("/proc/sys/kernel/arch", "aarch64");
    machine.put("/proc/sys/kernel/version", "#1 SMP PREEMPT Debian");
    machine.put("/proc/cmdline", "console=tty1");
    machine.put("/sys/devices/system/cpu/nohz_full", "(null)");
    machine.put("/boot/firmware/cmdline.txt", "console=tty1");
    EXPECT_EQ(finding_of(machine, "nohz_full")["fix"],
              "sudo sed -i '1s/$/ nohz_full=1/' /boot/firmware/cmdline.txt && sudo reboot");
    EXPECT_EQ(finding_of(machine, "preempt_rt")["fix"],
              "sudo apt install linux-image-rpi-v8-rt && echo kernel=kernel8_rt.img | sudo tee -a "
              "/boot/firmware/config.txt && sudo reboot");
    // A board has pins: virtual ones are not enough.
    EXPECT_EQ(finding_of(machine, "i2c")["state"], kMissing);
    EXPECT_EQ(finding_of(machine, "i2c")["fix"], "sudo raspi-config nonint do_i2c 0");
    EXPECT_EQ(finding_of(machine, "gpio")["state"], "ok");
}

TEST(Doctor, ADeviceOfSomebodyElseIsMissing) {
    if (::geteuid() != 0) GTEST_SKIP() << "needs to be root, to become somebody else";
    FakeMachine machine;
    furnish_well(machine);
    ::chmod(machine.path("/dev/gpiochip0").c_str(), 0600);
    ASSERT_EQ(::seteuid(65534), 0);
    const Json finding = finding_of(machine, "gpio");
    ASSERT_EQ(::seteuid(0), 0);
    EXPECT_EQ(finding["state"], kMissing);
    EXPECT_EQ(finding["found"], "gpiochip0: not for this user");
    EXPECT_EQ(finding["fix"], "sudo chgrp plugdev /dev/gpiochip0 && sudo chmod g+rw /dev/gpiochip0");
}

TEST(Doctor, ReadsThePackedConfiguration) {
    FakeMachine machine;
    furnish_well(machine);
    ::unlink(machine.path("/boot/config-6.12.30-rt-amd64").c_str());
    EXPECT_EQ(finding_of(machine, "kernel_options")["found"],
              "its configuration cannot be read here: not judged");
    machine.put("/proc/config", "CONFIG_HZ=1000");
    ASSERT_EQ(std::system(("gzip '" + machine.path("/proc/config") + "'").c_str()), 0);
    EXPECT_NE(
        finding_of(machine, "kernel_options")["found"].get<std::string>().find("HZ=1000, built without"),
        std::string::npos);
}

TEST(Doctor, ComputesStolenTime) {
    using doctor::stolen_percent;
    // user nice system idle iowait irq softirq steal guest guest_nice: 40 of 400, guest time not
    // counted twice
    EXPECT_DOUBLE_EQ(
        stolen_percent("cpu 100 0 50 1000 0 0 0 10 7 0\ncpu0 1", "cpu 200 0 110 1200 0 0 0 50 90 0"), 10.0);
    EXPECT_DOUBLE_EQ(stolen_percent("cpu 1 2 3 4 5 6 7 8 0 0", "cpu 1 2 3 4 5 6 7 8 0 0"), 0.0);
    EXPECT_DOUBLE_EQ(stolen_percent("", "nonsense"), 0.0);
}

TEST(Doctor, ChangesNothing) {
    FakeMachine machine;
    furnish_well(machine);
    const auto before = machine.everything();
    ask(machine, false);
    ask(machine, true);
    EXPECT_EQ(machine.everything(), before);
}

/// Whatever machine this is: every check says something, and shortfalls come with a fix.
TEST(Doctor, HasAnAnswerOnThisMachine) {
    const doctor::Facts facts{""};
    for (const doctor::Group& group : doctor::all_checks()) {
        for (const doctor::Check& check : group.checks) {
            const doctor::Finding finding = check.look(facts);
            EXPECT_FALSE(finding.found.empty()) << check.id;
            EXPECT_TRUE(finding.state == doctor::State::ok || !finding.fix.empty()) << check.id;
        }
    }
}

}  // namespace
}  // namespace qduino::apps::doctor_test
