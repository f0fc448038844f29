// The control groups of this process: where they are, and what they leave to it
// (Documentation/scheduler/sched-rt-group.rst, sched-bwc.rst and cgroup-v1/cpusets.rst in the
// kernel's tree).
//
// A loop's core is its own only as far as the groups around its program allow that:
//
//   cpu.rt_runtime_us      of real-time tasks, in each cpu.rt_period_us and on each core, where the
//                          kernel is built with RT_GROUP_SCHED. A group that has 0, as containers
//                          get it, takes no real-time task at all
//   cpu.cfs_quota_us,      of ordinary tasks, on all cores together. A group that has spent it
//   cpu.max                waits
//   cpuset.cpus            no thread gets onto another core
//
// The tightest group counts, from the top down to the own one. `root` precedes /proc and
// what it names (tests). Not real-time.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/time.h"
#include "board/linux/kernel/cpu_list.h"

namespace qduino::board::linux {

/// A mounted hierarchy, and this process's group in it.
struct Hierarchy {
    std::string top;    ///< folder of the mount
    std::string group;  ///< path of the own group below `top`: "" or "/a/b"
};

[[nodiscard]] bool has_word(std::string_view list, char separator, std::string_view word);
/// The hierarchy of `controller`, of version 1; that of version 2 for an empty name.
[[nodiscard]] std::optional<Hierarchy> find_hierarchy(const std::string& root, std::string_view controller);
/// The folders of the groups from the top down to the own one.
[[nodiscard]] std::vector<std::string> line_of(const Hierarchy& hierarchy);
/// The number behind `key` in the lines of a file; 0 when there is none.
[[nodiscard]] std::int64_t value_of(std::string_view lines, std::string_view key);

/// What a group leaves to tasks of a kind: `runtime` of each `period`.
struct GroupLimit {
    std::string file;  ///< the group's, that says so
    Nanoseconds runtime{};
    Nanoseconds period{};

    /// As a part of the period; above 1 for several cores together.
    [[nodiscard]] double share() const { return to_seconds(runtime) / to_seconds(period); }
};
/// The tightest limit of real-time tasks, on each core (cpu.rt_runtime_us). Nothing: the kernel was
/// built without such limits, or no group has one.
[[nodiscard]] std::optional<GroupLimit> real_time_group(const std::string& root = "");
/// The tightest limit of ordinary tasks, on all cores together (cpu.cfs_quota_us, cpu.max).
/// Nothing: no group around this process has one.
[[nodiscard]] std::optional<GroupLimit> cpu_quota(const std::string& root = "");

/// How long quotas have kept ordinary tasks of this process's groups waiting, on all cores in sum.
/// Nothing: no group around it has a quota.
[[nodiscard]] std::optional<Nanoseconds> kept_waiting_by_quota(const std::string& root = "");

/// The cores that the groups allow; the empty list where no one limits them.
[[nodiscard]] CpuList cores_of_cpuset(const std::string& root = "");

}  // namespace qduino::board::linux
