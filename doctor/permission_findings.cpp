// The rights of this user: priorities, locked memory, the computer's settings, real pins and buses.
#include <fcntl.h>
#include <grp.h>
#include <linux/capability.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>

#include "base/text.h"
#include "board/linux/kernel/control_groups.h"
#include "doctor/finding.h"

namespace qduino::apps::doctor {
namespace {

constexpr int kHighestPriority = 80;  // of a loop: LinuxConfig::priority_highest

std::string limits_fix(const std::string& line) {
    return "echo \"$USER - " + line +
           "\" | sudo tee -a /etc/security/limits.d/qduino.conf && echo \"Now log in again.\"";
}

Finding real_time_priority(const Facts& facts) {
    if (facts.capable(CAP_SYS_NICE)) return ok("CAP_SYS_NICE: any priority");
    const auto limit = facts.limit("Max realtime priority");
    if (!limit) return ok("not seen: not judged");
    const std::string found = "RLIMIT_RTPRIO is " + std::to_string(*limit);
    if (*limit < 0 || *limit >= kHighestPriority) return ok(found);
    return {*limit > 0 ? State::better : State::missing, found, limits_fix("rtprio 90")};
}

/// The share of the group that this process is in; not of the one that a service will be in.
Finding real_time_share(const Facts& facts) {
    const auto group = board::linux::real_time_group(facts.at(""));
    if (!group) return ok("no control group limits them");
    const std::string fix = "echo 950000 | sudo tee " + group->file;
    if (group->runtime == Nanoseconds{0})
        return missing("cpu.rt_runtime_us is 0: this control group takes no real-time task",
                       fix + "   (each group above it needs as much; docker run --cpu-rt-runtime=950000)");
    const auto found = text<std::string>(group->runtime, " in ", group->period, " on each core");
    // What the kernel leaves to the whole computer by default.
    constexpr double kUsual = 0.95;
    if (group->share() >= kUsual) return ok(found);
    return better(found + ": admission counts no more", fix);
}

/// Microseconds of CPU time without a wait, after which the kernel kills a real-time task.
Finding real_time_limit(const Facts& facts) {
    const auto limit = facts.limit("Max realtime timeout");
    if (!limit) return ok("not seen: not judged");
    if (*limit < 0) return ok("RLIMIT_RTTIME is unlimited");
    const auto found = text<std::string>("RLIMIT_RTTIME is ", *limit / 1000, " ms");
    if (facts.capable(CAP_SYS_RESOURCE)) return ok(found + ", and the board may lift it");
    return better(found + ": no loop may own a core",
                  "sudo prlimit --pid $$ --rttime=unlimited   (of a service: LimitRTTIME=infinity)");
}

Finding locked_memory(const Facts& facts) {
    if (facts.capable(CAP_IPC_LOCK)) return ok("CAP_IPC_LOCK: any amount");
    const auto limit = facts.limit("Max locked memory");
    if (!limit) return ok("not seen: not judged");
    if (*limit < 0) return ok("RLIMIT_MEMLOCK is unlimited");
    const std::string found = "RLIMIT_MEMLOCK is " + std::to_string(*limit / 1024) + " KiB";
    // Code, stacks and the pins' pages of a large sketch.
    constexpr long long kEnough = 256LL << 20;
    if (*limit >= kEnough) return ok(found);
    return missing(found, limits_fix("memlock unlimited"));
}

Finding isolation_rights(const Facts& facts) {
    if (facts.capable(CAP_SYS_ADMIN) && facts.capable(CAP_DAC_OVERRIDE))
        return ok("root: the board may set cores apart");
    return better("not root: loops share their cores with other tasks",
                  "start the sketch with sudo, or let systemd start it");
}

/// A command that gives this user access to `device`, by its group.
std::string group_fix(const Facts& facts, const std::string& device) {
    struct stat entry {};
    const group* owner = nullptr;
    if (::stat(facts.at("/dev/" + device).c_str(), &entry) == 0) owner = ::getgrgid(entry.st_gid);
    if (owner && entry.st_gid != 0 && (entry.st_mode & S_IRGRP) != 0 && (entry.st_mode & S_IWGRP) != 0)
        return std::string{"sudo usermod -aG "} + owner->gr_name + " \"$USER\" && echo \"Now log in again.\"";
    return "sudo chgrp plugdev /dev/" + device + " && sudo chmod g+rw /dev/" + device;
}

/// Devices of one kind. Their absence is a shortfall only on a board that has pins for wires.
Finding devices(const Facts& facts, const std::string& prefix, const std::string& enable) {
    std::vector<std::string> usable, refused;
    for (const std::string& name : facts.entries("/dev")) {
        if (!name.starts_with(prefix)) continue;
        const bool may =
            ::faccessat(AT_FDCWD, facts.at("/dev/" + name).c_str(), R_OK | W_OK, AT_EACCESS) == 0;
        (may ? usable : refused).push_back(name);
    }
    if (!refused.empty())
        return missing(some_of(refused, 3) + ": not for this user", group_fix(facts, refused[0]));
    if (!usable.empty()) return ok(some_of(usable, 4));
    if (!facts.has_device_tree()) return ok("none on this computer: virtual ones only");
    return missing("none", enable);
}

Finding gpio(const Facts& facts) {
    return devices(facts, "gpiochip", "install a kernel with CONFIG_GPIO_CDEV");
}
Finding i2c(const Facts& facts) {
    return devices(facts, "i2c-",
                   facts.is_raspberry_pi() ? "sudo raspi-config nonint do_i2c 0" : "sudo modprobe i2c-dev");
}
Finding spi(const Facts& facts) {
    return devices(facts, "spidev",
                   facts.is_raspberry_pi() ? "sudo raspi-config nonint do_spi 0" : "sudo modprobe spidev");
}

constexpr std::array kPermissionChecks{
    Check{"rt_priority", "without SCHED_FIFO every other program may run before a loop", real_time_priority},
    Check{"rt_group", "a control group may leave real-time tasks a part of each core, or nothing",
          real_time_share},
    Check{"rt_limit", "a loop that owns a core computes without a wait", real_time_limit},
    Check{"locked_memory", "a page that was not locked costs a loop a fault", locked_memory},
    Check{"isolation_rights", "setting a core apart changes cpusets, interrupts and throttling",
          isolation_rights},
    Check{"gpio", "real pins are lines of a GPIO chip", gpio},
    Check{"i2c", "real I2C chips are reached through it", i2c},
    Check{"spi", "real SPI chips are reached through it", spi},
};

}  // namespace

std::span<const Check> permission_checks() { return kPermissionChecks; }

}  // namespace qduino::apps::doctor
