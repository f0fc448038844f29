// The kernel, and how it keeps time.
#include <time.h>

#include <array>
#include <cstdlib>

#include "doctor/finding.h"
#include "terminal/human.h"

namespace qduino::apps::doctor {
namespace {

std::string real_time_kernel_fix(const Facts& facts) {
    const std::string architecture = facts.architecture();
    if (facts.is_raspberry_pi() && architecture != "aarch64")
        return "use the 64-bit Raspberry Pi OS: it has a real-time kernel, linux-image-rpi-v8-rt";
    if (facts.is_raspberry_pi()) {  // the package names its image so
        return "sudo apt install linux-image-rpi-v8-rt && echo kernel=kernel8_rt.img | sudo tee -a "
               "/boot/firmware/config.txt && sudo reboot";
    }
    const char* package = architecture == "aarch64"  ? "linux-image-rt-arm64"
                          : architecture == "armv7l" ? "linux-image-rt-armmp"
                                                     : "linux-image-rt-amd64";
    return std::string{"sudo apt install "} + package + " && sudo reboot";
}

bool is_real_time_kernel(const Facts& facts) {
    return facts.text("/sys/kernel/realtime") == "1" ||
           facts.text("/proc/sys/kernel/version").value_or("").find("PREEMPT_RT") != std::string::npos;
}

Finding preempt_rt(const Facts& facts) {
    if (is_real_time_kernel(facts)) return ok("PREEMPT_RT, " + facts.release());
    const std::string version = facts.text("/proc/sys/kernel/version").value_or("");
    const bool dynamic = version.find("PREEMPT_DYNAMIC") != std::string::npos;
    return better(facts.release() +
                      (dynamic ? ", PREEMPT_DYNAMIC: not a real-time kernel" : ": not a real-time kernel"),
                  real_time_kernel_fix(facts));
}

/// Options that the board's own parts need. For a possible module, "m" is as good as "y".
Finding kernel_options(const Facts& facts) {
    const auto hz = facts.built_with("CONFIG_HZ");
    if (!hz) return ok("its configuration cannot be read here: not judged");
    constexpr std::array kWanted{"CONFIG_HIGH_RES_TIMERS", "CONFIG_CPUSETS",     "CONFIG_NO_HZ_FULL",
                                 "CONFIG_RCU_NOCB_CPU",    "CONFIG_GPIO_CDEV",   "CONFIG_I2C_CHARDEV",
                                 "CONFIG_CPU_ISOLATION",   "CONFIG_POSIX_TIMERS"};
    std::vector<std::string> absent;
    for (const char* name : kWanted) {
        const std::string set = facts.built_with(name).value_or("");
        if (set != "y" && set != "m") absent.emplace_back(std::string{name}.substr(7));
    }
    const std::string tick = "HZ=" + *hz;
    if (absent.empty()) return ok(tick + ", all that the board uses is built in");
    return better(tick + ", built without " + some_of(absent, kWanted.size()),
                  is_real_time_kernel(facts)
                      ? "use a kernel that was built with these options, as Debian's are"
                      : real_time_kernel_fix(facts));
}

Finding timer_resolution(const Facts& facts) {
    // Root alone may read it.
    const auto listed = facts.value_in("/proc/timer_list", ".resolution");
    long long nanoseconds = listed ? std::atoll(listed->c_str()) : 0;
    if (!listed) {
        timespec resolution{};
        ::clock_getres(CLOCK_MONOTONIC, &resolution);
        nanoseconds = resolution.tv_sec * 1'000'000'000LL + resolution.tv_nsec;
    }
    const std::string found = "timers resolve " + human_duration(Nanoseconds{nanoseconds});
    if (nanoseconds <= 1000) return ok(found);
    if (facts.boot_parameter("highres") == "off")
        return missing(found + ": booted with highres=off", facts.boot_with("highres=on"));
    return missing(found + ": no high-resolution timers", real_time_kernel_fix(facts));
}

Finding clocksource(const Facts& facts) {
    const std::string folder = "/sys/devices/system/clocksource/clocksource0/";
    const auto current = facts.text(folder + "current_clocksource");
    if (!current) return ok("not seen: not judged");
    for (const char* fast : {"tsc", "arch_sys_counter", "timebase", "riscv_clocksource", "kvm-clock"}) {
        if (*current == fast) return ok(*current + ", read without a system call");
    }
    const std::string available = ' ' + facts.text(folder + "available_clocksource").value_or("") + ' ';
    for (const char* fast : {"tsc", "arch_sys_counter"}) {
        if (available.find(std::string{" "} + fast + " ") == std::string::npos) continue;
        return better(*current + ", though " + fast + " is there",
                      std::string{"echo "} + fast + " | sudo tee " + folder + "current_clocksource");
    }
    return better(*current + ": each look at the clock costs a microsecond or more",
                  facts.boot_with("tsc=reliable"));
}

/// What is not the loop's own and in its CPU time all the same (board/linux/loop/budget_keeper.h).
Finding charged_time(const Facts& facts) {
    const auto interrupts = facts.built_with("CONFIG_IRQ_TIME_ACCOUNTING");
    if (!interrupts) return ok("its configuration cannot be read here: not judged");
    const std::string flags = ' ' + facts.value_in("/proc/cpuinfo", "flags").value_or("") + ' ';
    const bool virtual_machine = flags.find(" hypervisor ") != std::string::npos;
    std::string charged, options;
    if (*interrupts != "y") {
        charged = "interrupts";
        options = "CONFIG_IRQ_TIME_ACCOUNTING";
    }
    if (virtual_machine && facts.built_with("CONFIG_PARAVIRT_TIME_ACCOUNTING") != "y") {
        write(charged, charged.empty() ? "" : ", and ", "what the host takes");
        write(options, options.empty() ? "" : " and ", "CONFIG_PARAVIRT_TIME_ACCOUNTING");
    }
    if (charged.empty()) return ok("a loop is charged for nothing but its own work");
    return better("a loop is charged for its own work, and for " + charged,
                  "use a kernel that was built with " + options);
}

/// What keeps loops from their warden (board/linux/kernel/confinement.h).
Finding loop_limits(const Facts& facts) {
    const auto filter = facts.built_with("CONFIG_SECCOMP_FILTER");
    if (!filter) return ok("its configuration cannot be read here: not judged");
    if (*filter != "y")
        return missing("no filter of system calls: a loop can make threads, and end its warden",
                       "use a kernel that was built with CONFIG_SECCOMP_FILTER, as Debian's are");
    if (facts.built_with("CONFIG_SECURITY_LANDLOCK") != "y")
        return better("no Landlock: a loop of root can write into its warden and the kernel's files",
                      "use a kernel that was built with CONFIG_SECURITY_LANDLOCK, as Debian's are");
    const auto modules = facts.text("/sys/kernel/security/lsm");
    if (modules && modules->find("landlock") == std::string::npos)
        return better("Landlock is off: a loop of root can write into its warden and the kernel's files",
                      facts.boot_with("lsm=landlock," + *modules));
    if (facts.built_with("CONFIG_PROC_CHILDREN") != "y")
        return better("the kernel tells no children: a process of setup()'s that ranks itself is not seen",
                      "use a kernel that was built with CONFIG_PROC_CHILDREN, as Debian's are");
    return ok("system calls and files of loops are limited");
}

constexpr std::array kKernelChecks{
    Check{"preempt_rt", "without it the kernel delays a loop by up to milliseconds under load", preempt_rt},
    Check{"kernel_options", "isolation, tickless cores and pins need these parts of the kernel",
          kernel_options},
    Check{"timer_resolution", "without high-resolution timers a loop wakes at the next tick only",
          timer_resolution},
    Check{"charged_time", "what is charged to a loop and is not its own makes it late by T/C times as long",
          charged_time},
    Check{"loop_limits", "a loop that can reach the warden of its budget has none", loop_limits},
    Check{"clocksource", "a loop that times pulses reads the clock all the time", clocksource},
};

}  // namespace

std::span<const Check> kernel_checks() { return kKernelChecks; }

}  // namespace qduino::apps::doctor
