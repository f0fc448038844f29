// The cores, and the interrupts that reach the one that a loop would own, with the programs that
// move them: are there enough, can a sketch have one alone, does it run at full speed?
#include <array>

#include "base/text.h"
#include "beside/boot_line.h"
#include "board/linux/computer/interference_memory.h"
#include "board/linux/kernel/device_interrupts.h"
#include "doctor/finding.h"
#include "terminal/human.h"

namespace qduino::apps::doctor {
namespace {

using board::linux::CpuList;
using board::linux::Interrupt;

const Finding kOneCore{State::ok, "one core only: nothing can be set apart", ""};

Finding cores(const Facts& facts) {
    const int count = facts.core_count();
    if (count >= 2) return ok(std::to_string(count) + " cores");
    return missing("1 core",
                   "use a board with two cores or more; a virtual machine: give it a second processor");
}

/// The generation of cpusets, and whether the board could use it.
Finding cpusets(const Facts& facts) {
    const CpuList isolated = facts.cpus("/sys/devices/system/cpu/isolated");
    const std::string at_boot = isolated.empty() ? "" : "; isolcpus=" + isolated.to_list();
    if (facts.exists("/sys/fs/cgroup/cpuset/cpuset.cpus")) return ok("cpusets of cgroup v1" + at_boot);
    const auto controllers = facts.text("/sys/fs/cgroup/cgroup.controllers");
    if (controllers && controllers->find("cpuset") != std::string::npos)
        return ok("cpusets of cgroup v2" + at_boot);
    const State state = isolated.empty() ? State::missing : State::better;
    if (facts.boot_parameter("cgroup_disable").value_or("").find("cpuset") != std::string::npos)
        return {state, "booted with cgroup_disable=cpuset" + at_boot,
                facts.boot_with("cgroup_enable=cpuset")};
    const auto groups = facts.text("/proc/cgroups");
    if (groups && groups->find("cpuset") == std::string::npos)
        return {state, "the kernel has no cpusets" + at_boot,
                facts.boot_with("isolcpus=" + facts.owned_core_name())};
    if (controllers) {
        return {state, "cgroup v2 without its cpuset controller" + at_boot,
                "sudo mkdir -p /sys/fs/cgroup/cpuset && sudo mount -t cgroup -o cpuset none "
                "/sys/fs/cgroup/cpuset"};
    }
    return {state, "no cpusets mounted" + at_boot, "sudo mount -t cgroup2 none /sys/fs/cgroup"};
}

Finding nohz_full(const Facts& facts) {
    if (facts.core_count() < 2) return kOneCore;
    const CpuList tickless = facts.cpus("/sys/devices/system/cpu/nohz_full");
    if (tickless.has(facts.owned_core())) return ok("core " + tickless.to_list());
    const std::string parameter = "nohz_full=" + facts.owned_core_name();
    if (facts.boot_parameter("nohz_full") || facts.built_with("CONFIG_NO_HZ_FULL") == "") {
        return better(
            "this kernel cannot stop the tick of a busy core",
            "use a kernel that was built with CONFIG_NO_HZ_FULL, as Debian's are, and boot it with " +
                parameter);
    }
    return better("no core's tick stops", facts.boot_with(parameter));
}

Finding rcu_nocbs(const Facts& facts) {
    if (facts.core_count() < 2) return kOneCore;
    const int core = facts.owned_core();
    for (const char* name : {"rcu_nocbs", "nohz_full"}) {  // nohz_full implies it
        const auto value = facts.boot_parameter(name);
        const auto list = value ? CpuList::from_list(*value) : std::nullopt;
        const bool all =
            value == "all" || value == "0-N" || (std::string_view{name} == "rcu_nocbs" && value == "");
        if (all || (list && list->has(core))) return ok(std::string{name} + "=" + *value);
    }
    return better("RCU callbacks run on every core", facts.boot_with("rcu_nocbs=" + facts.owned_core_name()));
}

Finding siblings(const Facts& facts) {
    const std::string core = std::to_string(std::max(0, facts.owned_core()));
    const CpuList threads =
        facts.cpus("/sys/devices/system/cpu/cpu" + core + "/topology/thread_siblings_list");
    if (threads.size() <= 1) return ok("core " + core + " has no hardware sibling");
    return better("cores " + threads.to_list() + " share one processor core",
                  "echo off | sudo tee /sys/devices/system/cpu/smt/control");
}

Finding governor(const Facts& facts) {
    const std::string cpu = "/sys/devices/system/cpu/cpu" + std::to_string(std::max(0, facts.owned_core()));
    const auto policy = facts.text(cpu + "/cpufreq/scaling_governor");
    if (!policy) return ok("the kernel does not scale the clock here");
    if (*policy == "performance") return ok(*policy);
    return better(*policy,
                  "echo performance | sudo tee /sys/devices/system/cpu/cpu*/cpufreq/scaling_governor");
}

Finding throttling(const Facts& facts) {
    const auto limit = facts.text("/proc/sys/kernel/sched_rt_runtime_us");
    if (!limit) return ok("not seen: not judged");
    const std::string fix = "sudo sysctl kernel.sched_rt_runtime_us=950000";
    if (*limit == "-1") return better("lifted for good: a loop that hangs takes the computer with it", fix);
    if (*limit == "0") return missing("0: real-time threads never run", fix);
    return ok(*limit + " us in each second; lifted while a core is owned");
}

Finding fair_server(const Facts& facts) {
    if (!facts.kernel_at_least(6, 12)) return ok("kernels before 6.12 have none");
    if (facts.exists("/sys/kernel/debug/sched/fair_server")) return ok("lifted while a core is owned");
    if (facts.exists("/sys/kernel/debug/sched")) return ok("this kernel has none");
    return better("cannot be reached: debugfs is not mounted, or not for this user",
                  "sudo mount -t debugfs none /sys/kernel/debug");
}

/// No fault, for few want it: what is lacking is told as a fact.
Finding core_beside_linux(const Facts& facts) {
    if (facts.architecture() != "x86_64") return ok("of x86-64 computers only");
    if (facts.core_count() < 2) return kOneCore;
    const auto line = apps::beside_linux::read_boot_line(apps::beside_linux::this_computer(facts.at("")));
    if (line.missing.empty()) return ok("this computer was booted for it");
    return {State::ok, "Linux was not booted for 'qduino metal beside'",
            facts.boot_with(apps::beside_linux::joined(line.missing))};
}

/// Interrupts with a handler that go to the core of a loop.
std::vector<Interrupt> interrupts_on_core(const Facts& facts) {
    const int core = facts.owned_core();
    std::vector<Interrupt> here;
    for (Interrupt& irq : board::linux::all_interrupts(facts.at(""))) {
        if (irq.used && irq.target.has(core)) here.push_back(std::move(irq));
    }
    return here;
}

Finding interrupt_affinity(const Facts& facts) {
    if (facts.core_count() < 2) return kOneCore;
    const int core = facts.owned_core();
    std::vector<std::string> here;
    for (const Interrupt& irq : interrupts_on_core(facts)) {
        if (irq.movable) here.push_back(irq.name());
    }
    const std::string on_core = " on core " + std::to_string(core);
    if (here.empty()) return ok("no movable interrupt" + on_core);
    CpuList rest = CpuList::first(facts.core_count());
    rest.remove(core);
    return better(std::to_string(here.size()) + on_core + ": " + some_of(here, 5),
                  facts.boot_with("irqaffinity=" + rest.to_list()));
}

/// As the last starts and runs have seen it. A core that nobody has looked at is left out.
Finding interrupt_time(const Facts& facts) {
    std::string found;
    for (int core = 0; core < facts.core_count(); ++core) {
        auto memory = board::linux::InterferenceMemory::read(core, facts.at(""));
        if (memory.size() == 0) continue;
        const board::linux::Interference known = memory.interference();
        const auto percent = [](std::int64_t ppm) { return Fixed{static_cast<double>(ppm) * 1e-4, 1}; };
        write(found, found.empty() ? "" : "; ", "core ", core, ": ", percent(known.found_ppm), " % of it in ",
              memory.size(), " looks, counted as ", human_duration(known.counts.at_once()), " at once and ",
              percent(known.counts.share_ppm), " %");
        if (known.stalls > 0) write(found, " (", counted(known.stalls, "look"), " had more)");
    }
    return ok(found.empty() ? "not measured since boot: the first sketch of a shared core does" : found);
}

/// Only interrupts that could be elsewhere. A disk with a queue for each core is none: the core's
/// own queue is silent while the core is not used.
Finding managed_interrupts(const Facts& facts) {
    if (facts.core_count() < 2) return kOneCore;
    std::vector<std::string> here;
    for (const Interrupt& irq : interrupts_on_core(facts)) {
        if (!irq.movable && irq.allowed.size() > 1) here.push_back(irq.name());
    }
    const std::string core = facts.owned_core_name();
    if (here.empty()) return ok("none on core " + core);
    const char* kept =
        facts.boot_parameter("isolcpus") ? "isolcpus=managed_irq,domain," : "isolcpus=managed_irq,";
    return better(some_of(here, 5) + " on core " + core, facts.boot_with(kept + core));
}

Finding irqbalance(const Facts& facts) {
    if (!facts.runs("irqbalance")) return ok("not running");
    return better("running", "sudo systemctl disable --now irqbalance");
}

constexpr std::array kCoreChecks{
    Check{"cores", "a loop that owns a core leaves one for everything else", cores},
    Check{"cpusets", "they keep all other tasks off a core that a loop owns", cpusets},
    Check{"nohz_full", "each tick takes some microseconds out of a core that a loop owns", nohz_full},
    Check{"rcu_nocbs", "the kernel's deferred frees run where they were asked for, the loop's core included",
          rcu_nocbs},
    Check{"smt", "what runs on the sibling slows the loop down by half", siblings},
    Check{"governor", "a core that is clocked down makes a loop late, and its budget too small", governor},
    Check{"rt_throttling", "the kernel takes 50 ms of each second from real-time threads", throttling},
    Check{"fair_server", "ordinary tasks get 50 ms of each second even on a loop's core", fair_server},
    Check{"beside", "Linux can give a core up to a sketch that runs beside it, without Linux",
          core_beside_linux},
};

constexpr std::array kInterruptChecks{
    Check{"irq_affinity",
          "a device's interrupt on a loop's core makes a pulse late, until the board moves it",
          interrupt_affinity},
    Check{"managed_irqs", "its driver keeps it on a loop's core, with the threads that finish its work",
          managed_interrupts},
    Check{"interrupt-time", "admission counts it above every loop, the same from start to start",
          interrupt_time},
    Check{"irqbalance", "it puts interrupts back on the core from which the board has moved them",
          irqbalance},
};

}  // namespace

std::span<const Check> core_checks() { return kCoreChecks; }
std::span<const Check> interrupt_checks() { return kInterruptChecks; }

}  // namespace qduino::apps::doctor
