// The kernel, and how it keeps time.
#include <time.h>

#include <array>
#include <cstdlib>

#include "apps/doctor/finding.h"
#include "apps/terminal/human.h"

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

constexpr std::array kKernelChecks{
    Check{"preempt_rt", "without it the kernel delays a loop by up to milliseconds under load", preempt_rt},
    Check{"kernel_options", "isolation, tickless cores and pins need these parts of the kernel",
          kernel_options},
    Check{"timer_resolution", "without high-resolution timers a loop wakes at the next tick only",
          timer_resolution},
    Check{"clocksource", "a loop that times pulses reads the clock all the time", clocksource},
};

}  // namespace

std::span<const Check> kernel_checks() { return kKernelChecks; }

}  // namespace qduino::apps::doctor
