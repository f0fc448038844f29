#include "board/linux/kernel/control_groups.h"

#include <algorithm>

#include "base/whole_number.h"
#include "board/linux/kernel/host_settings.h"
#include "board/linux/kernel/kernel_text.h"

namespace qduino::board::linux {
namespace {

/// The own group in the hierarchy with `controller`; in the unified one for an empty name. See
/// cgroups(7), /proc/PID/cgroup.
std::optional<std::string> own_group(std::string_view lines, std::string_view controller) {
    while (!lines.empty()) {
        std::string_view path = cut(lines, '\n');
        static_cast<void>(cut(path, ':'));
        const std::string_view controllers = cut(path, ':');
        const bool fits = controller.empty() ? controllers.empty() : has_word(controllers, ',', controller);
        if (fits) return std::string{path};
    }
    return std::nullopt;
}

/// The own group and those around it, of whichever version has `file`.
std::vector<std::string> groups_with(const std::string& root, std::string_view controller,
                                     const std::string& file) {
    std::vector<std::string> found;
    for (const std::string_view version : {controller, std::string_view{}}) {
        const std::optional<Hierarchy> hierarchy = find_hierarchy(root, version);
        if (!hierarchy) continue;
        for (const std::string& folder : line_of(*hierarchy)) {
            if (posix::read_small_file(folder + "/" + file)) found.push_back(folder);
        }
        if (!found.empty()) break;
    }
    return found;
}

std::optional<std::int64_t> number_in(const std::string& path) {
    return whole_number<std::int64_t>(text_of_file(path));
}

/// Version 1: "-1" is none. Version 2: "max 100000" is, and "10000 100000" is 10 ms in 100 ms.
std::optional<GroupLimit> quota_of(const std::string& folder) {
    const std::string second = text_of_file(folder + "/cpu.max");
    std::string_view rest = second;
    const auto runtime =
        second.empty() ? number_in(folder + "/cpu.cfs_quota_us") : whole_number<std::int64_t>(cut(rest, ' '));
    const auto period =
        second.empty() ? number_in(folder + "/cpu.cfs_period_us") : whole_number<std::int64_t>(rest);
    if (!runtime || *runtime <= 0) return std::nullopt;
    // 100 ms is the kernel's own where none is written (kernel/sched/fair.c).
    return GroupLimit{folder + (second.empty() ? "/cpu.cfs_quota_us" : "/cpu.max"), *runtime * 1us,
                      period.value_or(100'000) * 1us};
}

/// Keeps the tighter of two.
void keep_tighter(std::optional<GroupLimit>& tightest, const GroupLimit& limit) {
    if (!tightest || limit.share() < tightest->share()) tightest = limit;
}

}  // namespace

bool has_word(std::string_view list, char separator, std::string_view word) {
    while (!list.empty()) {
        if (cut(list, separator) == word) return true;
    }
    return false;
}

/// The mount of a hierarchy: "36 35 0:31 ROOT TOP options - TYPE source SUPER"
/// (proc_pid_mountinfo(5)).
std::optional<Hierarchy> find_hierarchy(const std::string& root, std::string_view controller) {
    const std::string groups = text_of_file(root + "/proc/self/cgroup");
    const std::string mounts = text_of_file(root + "/proc/self/mountinfo");
    const std::optional<std::string> own = own_group(groups, controller);
    if (!own) return std::nullopt;
    for (std::string_view rest = mounts; !rest.empty();) {
        const std::string_view line = cut(rest, '\n');
        const std::size_t dash = line.find(" - ");
        const auto before = words(line.substr(0, dash));
        const auto behind =
            dash == std::string_view::npos ? std::vector<std::string_view>{} : words(line.substr(dash + 3));
        if (before.size() < 5 || behind.size() < 3) continue;
        const bool fits = controller.empty() ? behind[0] == "cgroup2"
                                             : behind[0] == "cgroup" && has_word(behind[2], ',', controller);
        if (!fits) continue;
        // The mount may show a part of the hierarchy alone, as in a container.
        const std::string_view shown = before[3] == "/" ? std::string_view{} : before[3];
        Hierarchy found{.top = root + std::string{before[4]}, .group = {}};
        if (own->starts_with(shown) && *own != "/") found.group = own->substr(shown.size());
        return found;
    }
    return std::nullopt;
}

std::vector<std::string> line_of(const Hierarchy& hierarchy) {
    std::vector<std::string> line{hierarchy.top};
    std::string_view rest = hierarchy.group;
    while (!rest.empty()) {
        const std::string_view part = cut(rest, '/');
        if (!part.empty() && part != "..") line.push_back(line.back() + "/" + std::string{part});
    }
    return line;
}

std::int64_t value_of(std::string_view lines, std::string_view key) {
    while (!lines.empty()) {
        std::string_view value = cut(lines, '\n');
        if (cut(value, ' ') == key) return whole_number<std::int64_t>(value).value_or(0);
    }
    return 0;
}

std::optional<GroupLimit> real_time_group(const std::string& root) {
    std::optional<GroupLimit> tightest;
    // Without the limit of the whole computer there is none of a group (kernel/sched/rt.c).
    if (text_of_file(root + "/proc/sys/kernel/sched_rt_runtime_us").starts_with("-1")) return tightest;
    for (const std::string& folder : groups_with(root, "cpu", "cpu.rt_runtime_us")) {
        const std::string file = folder + "/cpu.rt_runtime_us";
        const auto runtime = number_in(file), period = number_in(folder + "/cpu.rt_period_us");
        if (!runtime || !period || *runtime < 0 || *period <= *runtime) continue;
        keep_tighter(tightest, {file, *runtime * 1us, *period * 1us});
    }
    return tightest;
}

std::optional<GroupLimit> cpu_quota(const std::string& root) {
    std::optional<GroupLimit> tightest;
    for (const std::string& folder : groups_with(root, "cpu", "cpu.stat")) {
        if (const auto quota = quota_of(folder)) keep_tighter(tightest, *quota);
    }
    return tightest;
}

std::optional<Nanoseconds> kept_waiting_by_quota(const std::string& root) {
    std::optional<Nanoseconds> longest;
    for (const std::string& folder : groups_with(root, "cpu", "cpu.stat")) {
        if (!quota_of(folder)) continue;
        const std::string lines = text_of_file(folder + "/cpu.stat");
        const Nanoseconds waited{value_of(lines, "throttled_time") +
                                 value_of(lines, "throttled_usec") * 1000};
        longest = std::max(longest.value_or(Nanoseconds{0}), waited);
    }
    return longest;
}

CpuList cores_of_cpuset(const std::string& root) {
    CpuList allowed;
    for (const char* file : {"cpuset.cpus.effective", "cpuset.effective_cpus", "cpuset.cpus"}) {
        for (const std::string& folder : groups_with(root, "cpuset", file)) {
            const CpuList here = read_cpu_list(folder + "/" + file);
            // The own group comes last, and has no more than those above it.
            if (!here.empty()) allowed = here;
        }
        if (!allowed.empty()) break;
    }
    return allowed;
}

}  // namespace qduino::board::linux
